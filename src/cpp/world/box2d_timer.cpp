// The timer of Box2D without a clock.
//
// Box2D reads the wall time more than a dozen times in a step, and again for each group of bodies,
// for a profile that flatland does not use. In a world with few contacts, reading the time takes
// longer than the step itself. The dynamic linker searches the extension before the libraries of
// the extension, and therefore prefers these definitions to the definitions of the library.
//
// All times of b2World::GetProfile are 0. step_guard.cpp relies on the moment at which Box2D writes
// one of these times.
#include <box2d/b2_timer.h>

b2Timer::b2Timer() : m_start_sec(0), m_start_usec(0) {}

void b2Timer::Reset() {}

float b2Timer::GetMilliseconds() const { return 0.0F; }
