// Points and poses as tuples of Python.
#pragma once

#include <box2d/b2_math.h>

#include <tuple>

#include "world/triple.h"

namespace flatland {

using PyPair = std::tuple<double, double>;
using PyTriple = std::tuple<double, double, double>;

inline PyPair to_python(const b2Vec2& v) {
  return {static_cast<double>(v.x), static_cast<double>(v.y)};
}
inline PyTriple to_python(const Triple& t) { return {t[0], t[1], t[2]}; }
inline Triple from_python(const PyTriple& t) {
  return {std::get<0>(t), std::get<1>(t), std::get<2>(t)};
}

}  // namespace flatland
