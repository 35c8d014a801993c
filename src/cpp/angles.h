// Constants of angles [rad].
#pragma once

namespace flatland {

inline constexpr double kPi = 3.141592653589793;
inline constexpr double kTwoPi = 6.283185307179586;

}  // namespace flatland
