# SIMD targets that nothing is compiled for: SSSE3 and AVX3_DL gain nothing over SSE4 and AVX3; vectors of SVE have no
# size, and no structure can have them as members.
set(SQUINT_LEFT_OUT_TARGETS HWY_SSSE3 HWY_AVX3_DL HWY_SVE HWY_SVE2 HWY_SVE_256 HWY_SVE2_128)
