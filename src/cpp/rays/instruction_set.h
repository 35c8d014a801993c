// The instruction sets for which inner loops are compiled. All of them give the same results.
#pragma once

namespace flatland {

enum class InstructionSet { kBaseline, kAvx2, kAvx512 };

// Returns the best instruction set of the processor, or a lesser one that the environment variable
// FLATLAND_SIMD selects: "baseline", "avx2" or "avx512". The first call determines the result.
InstructionSet instruction_set();

}  // namespace flatland
