#include "rays/materials.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace flatland {
namespace {

constexpr double kWords = 4294967296.0;

bool is_same(const Material& a, const Material& b) {
  return a.reflectance == b.reflectance && a.transmission == b.transmission &&
         a.specular == b.specular;
}

}  // namespace

void Materials::set(std::uint32_t slot, const Material& material) {
  const std::uint16_t added = number(material);
  if (slot >= numbers_.size()) numbers_.resize(std::size_t{slot} + 1, 0);
  if (numbers_[slot] == 0) ++count_;
  numbers_[slot] = added;
}

void Materials::erase(std::uint32_t slot) {
  if (number_of(slot) == 0) return;
  numbers_[slot] = 0;
  if (--count_ == 0) clear();
}

std::uint16_t Materials::number(const Material& material) {
  const auto known = std::find_if(entries_.begin() + 1, entries_.end(),
                                  [&](const Material& entry) { return is_same(entry, material); });
  if (known != entries_.end()) return static_cast<std::uint16_t>(known - entries_.begin());
  if (entries_.size() > std::numeric_limits<std::uint16_t>::max()) {
    throw std::length_error("a world can have at most 65535 different materials");
  }
  const auto transmission = static_cast<double>(material.transmission);
  const auto specular = static_cast<double>(material.specular);
  Optics optics;
  optics.reflectance = std::abs(material.reflectance);  // not -0, whose sign has a meaning
  if (transmission >= 1.0) {
    optics.pass_limit = Optics::kInvisible;
  } else if (transmission > 0.0) {
    const double limit = std::round(transmission * kWords);
    optics.pass_limit = static_cast<std::uint32_t>(std::clamp(limit, 1.0, kWords - 2.0));
  }
  bool is_partial = optics.pass_limit != Optics::kOpaque;
  if (specular > 0.0) {
    // In single precision, shares with the sum 1 add up to 1 only approximately.
    constexpr double kAll = 1.0 - 1e-6;
    const double share = transmission + specular;
    const double limit = share >= kAll ? kWords : std::max(std::floor(share * kWords), 1.0);
    optics.last_reflected = static_cast<std::uint32_t>(limit - 1.0);
    optics.is_mirror = true;
    has_mirrors_ = true;
    is_partial = is_partial || limit < kWords;
  }
  if (is_partial && optics.pass_limit != Optics::kInvisible) needs_words_ = true;
  entries_.push_back(material);
  optics_.push_back(optics);
  return static_cast<std::uint16_t>(entries_.size() - 1);
}

}  // namespace flatland
