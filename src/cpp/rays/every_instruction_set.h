// Compiles a kernel for several instruction sets, and selects one of them at run time.
//
// A source file includes this file once, in an anonymous namespace with a struct `Functions` of
// pointers to functions. FLATLAND_KERNEL is the path of the kernel: a file without include guard
// that uses a type `Lanes` (see simd.h), and ends with a constant `kFunctions`.

namespace baseline {
using Lanes = simd::Lanes8;
#include FLATLAND_KERNEL
}  // namespace baseline

#if defined(__x86_64__)
FLATLAND_BEGIN_TARGET("avx2")
namespace avx2 {
namespace simd = flatland::avx2::simd;
using Lanes = simd::Lanes8Avx2;
#include FLATLAND_KERNEL
}  // namespace avx2
FLATLAND_END_TARGET

FLATLAND_BEGIN_TARGET("avx512f,avx512vl,avx512dq,avx512bw")
namespace avx512 {
namespace simd = flatland::avx512::simd;
using Lanes = simd::Lanes16;
#include FLATLAND_KERNEL
}  // namespace avx512
FLATLAND_END_TARGET
#endif

#undef FLATLAND_KERNEL

const Functions& functions() {
  static const Functions kSelected = [] {
#if defined(__x86_64__)
    if (instruction_set() == InstructionSet::kAvx512) return avx512::kFunctions;
    if (instruction_set() == InstructionSet::kAvx2) return avx2::kFunctions;
#endif
    return baseline::kFunctions;
  }();
  return kSelected;
}
