#include "rays/instruction_set.h"

#include <algorithm>
#include <cstdlib>
#include <string_view>

namespace flatland {
namespace {

InstructionSet best_of_processor() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
      __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw")) {
    return InstructionSet::kAvx512;
  }
  if (__builtin_cpu_supports("avx2")) return InstructionSet::kAvx2;
#endif
  return InstructionSet::kBaseline;
}

InstructionSet limit() {
  const char* value = std::getenv("FLATLAND_SIMD");
  const std::string_view name = value == nullptr ? "" : value;
  if (name == "baseline") return InstructionSet::kBaseline;
  if (name == "avx2") return InstructionSet::kAvx2;
  return InstructionSet::kAvx512;
}

}  // namespace

InstructionSet instruction_set() {
  static const InstructionSet kSelected = std::min(best_of_processor(), limit());
  return kSelected;
}

}  // namespace flatland
