// The instruction sets for which inner loops are compiled. Results are the same with all of them.
#pragma once

namespace flatland {

enum class InstructionSet { kBaseline, kAvx2, kAvx512 };

// The best one that the processor has, or a lesser one named by the environment variable
// FLATLAND_SIMD: "baseline", "avx2" or "avx512". It is determined by the first call.
InstructionSet instruction_set();

}  // namespace flatland
