// Compiled with -fno-builtin, as controllers.cpp.
#include "world/easing.h"

#include <math.h>

#include <stdexcept>

#include "angles.h"

namespace flatland {
namespace {

using Family = Easing::Family;
using Shape = Easing::Shape;

constexpr double kOvershoot = 1.70158;
constexpr double kInOutOvershoot = kOvershoot * 1.525;
constexpr double kPeriod = 0.3;
constexpr double kInOutPeriod = kPeriod * 1.5;

struct NamedFamily {
  const char* name;
  Family family;
};

constexpr NamedFamily kFamilies[] = {
    {"quadratic", Family::kQuadratic},
    {"cubic", Family::kCubic},
    {"quartic", Family::kQuartic},
    {"quintic", Family::kQuintic},
    {"exponential", Family::kExponential},
    {"circular", Family::kCircular},
    {"back", Family::kBack},
    {"elastic", Family::kElastic},
    {"bounce", Family::kBounce},
};

struct NamedShape {
  const char* suffix;
  Shape shape;
};

constexpr NamedShape kShapes[] = {
    {"In", Shape::kIn}, {"Out", Shape::kOut}, {"InOut", Shape::kInOut}};

double exponential(double p) { return exp2(10.0 * (p - 1.0)); }

double back(double p, double overshoot) { return p * p * ((overshoot + 1.0) * p - overshoot); }

double elastic(double p, double period) {
  const double phase = (p - 1.0 - period / 4.0) * kTwoPi / period;
  return -exponential(p) * sin(phase);
}

// The parabolas of a bouncing ball, in units of 1 / 2.75 of the duration.
double bounce(double p) {
  struct Parabola {
    double end, top, drop;  // end time, time of the apex, drop of the apex below the first apex
  };
  constexpr Parabola kParabolas[] = {{1.0, 0.0, 0.0}, {2.0, 1.5, 0.75}, {2.5, 2.25, 0.9375}};
  const double t = 2.75 * (1.0 - p);
  Parabola found{HUGE_VAL, 2.625, 0.984375};
  for (const Parabola& parabola : kParabolas) {
    if (t < parabola.end) {
      found = parabola;
      break;
    }
  }
  return 1.0 - (pow(t - found.top, 2.0) + found.drop);
}

// Returns the In curve, or the curve of which the InOut curve consists.
double ease_in(Family family, bool is_half, double p) {
  switch (family) {
    case Family::kLinear:
      return p;
    case Family::kQuadratic:
      return pow(p, 2.0);
    case Family::kCubic:
      return pow(p, 3.0);
    case Family::kQuartic:
      return pow(p, 4.0);
    case Family::kQuintic:
      return pow(p, 5.0);
    case Family::kExponential:
      return exponential(p);
    case Family::kCircular:
      return 1.0 - sqrt(1.0 - p * p);
    case Family::kBack:
      return back(p, is_half ? kInOutOvershoot : kOvershoot);
    case Family::kElastic:
      return elastic(p, is_half ? kInOutPeriod : kPeriod);
    case Family::kBounce:
      return bounce(p);
  }
  return p;
}

}  // namespace

double Easing::operator()(double p) const {
  // Some formulas are inexact at the ends.
  if (p <= 0.0) return 0.0;
  if (p >= 1.0) return 1.0;
  if (shape == Shape::kIn) return ease_in(family, false, p);
  if (shape == Shape::kOut) return 1.0 - ease_in(family, false, 1.0 - p);
  // The first half is a scaled copy of the In curve, the second half the mirror image of the first.
  if (p < 0.5) return ease_in(family, true, 2.0 * p) / 2.0;
  return 1.0 - ease_in(family, true, 2.0 - 2.0 * p) / 2.0;
}

Easing easing_of(const std::string& name) {
  if (name == "linear") return {Family::kLinear, Shape::kIn};
  for (const auto& [family_name, family] : kFamilies) {
    for (const auto& [suffix, shape] : kShapes) {
      if (name == std::string(family_name) + suffix) return {family, shape};
    }
  }
  throw std::invalid_argument("the easing \"" + name + "\" does not exist");
}

std::vector<std::string> easing_names() {
  std::vector<std::string> names = {"linear"};
  for (const auto& [family_name, family] : kFamilies) {
    static_cast<void>(family);
    for (const auto& [suffix, shape] : kShapes) {
      static_cast<void>(shape);
      names.push_back(std::string(family_name) + suffix);
    }
  }
  return names;
}

}  // namespace flatland
