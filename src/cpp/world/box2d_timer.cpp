// The timer of Box2D without a clock.
//
// Box2D reads the wall time more than a dozen times in a step, and again for each group of bodies,
// to fill a profile that nothing displays. In a world with few contacts that takes more time than
// the step itself. The dynamic linker prefers these definitions to those of the library, because it
// searches the extension before the libraries that the extension requires.
//
// The times of b2World::GetProfile are 0. The guard relies on the moment at which one of them is
// written, see step_guard.cpp.
#include <box2d/b2_timer.h>

b2Timer::b2Timer() : m_start_sec(0), m_start_usec(0) {}

void b2Timer::Reset() {}

float b2Timer::GetMilliseconds() const { return 0.0F; }
