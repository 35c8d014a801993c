// Included before each source file by tools/wheel/c++: mathematical functions are those of the C library, as in other
// builds. The runtime library of the compiler contains functions of the same names, with slightly different results.
#define FLATLAND_C_LIBRARY(function) __asm__(".symver " #function "," #function "@GLIBC_2.2.5")
FLATLAND_C_LIBRARY(ceil);
FLATLAND_C_LIBRARY(ceilf);
FLATLAND_C_LIBRARY(cos);
FLATLAND_C_LIBRARY(cosf);
FLATLAND_C_LIBRARY(exp);
FLATLAND_C_LIBRARY(expf);
FLATLAND_C_LIBRARY(exp2);
FLATLAND_C_LIBRARY(exp2f);
FLATLAND_C_LIBRARY(floor);
FLATLAND_C_LIBRARY(floorf);
FLATLAND_C_LIBRARY(fma);
FLATLAND_C_LIBRARY(fmaf);
FLATLAND_C_LIBRARY(fmod);
FLATLAND_C_LIBRARY(fmodf);
FLATLAND_C_LIBRARY(log);
FLATLAND_C_LIBRARY(logf);
FLATLAND_C_LIBRARY(log10);
FLATLAND_C_LIBRARY(log10f);
FLATLAND_C_LIBRARY(log2);
FLATLAND_C_LIBRARY(log2f);
FLATLAND_C_LIBRARY(round);
FLATLAND_C_LIBRARY(roundf);
FLATLAND_C_LIBRARY(sin);
FLATLAND_C_LIBRARY(sinf);
FLATLAND_C_LIBRARY(sincos);
FLATLAND_C_LIBRARY(sincosf);
FLATLAND_C_LIBRARY(sqrt);
FLATLAND_C_LIBRARY(sqrtf);
FLATLAND_C_LIBRARY(tan);
FLATLAND_C_LIBRARY(tanf);
FLATLAND_C_LIBRARY(trunc);
FLATLAND_C_LIBRARY(truncf);
