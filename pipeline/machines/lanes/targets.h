// The SIMD targets that are compiled: AVX-512, AVX2, SSE4, NEON and plain C++ (EMU128, "scalar"), and how to
// call one by name.  Included before Highway in every file of kernels.
#ifndef HWY_COMPILE_ALL_ATTAINABLE
#define HWY_COMPILE_ALL_ATTAINABLE
#endif
#include <hwy/detect_targets.h>

// Defines F(target, ...), which calls the same function in the namespace of one target; Highway's own
// dispatch offers only the best.
#if HWY_TARGETS & HWY_AVX3
#define SQUINT_CASE_AVX3(F, ...) \
    case HWY_AVX3:               \
        return N_AVX3::F(__VA_ARGS__);
#else
#define SQUINT_CASE_AVX3(F, ...)
#endif
#if HWY_TARGETS & HWY_AVX2
#define SQUINT_CASE_AVX2(F, ...) \
    case HWY_AVX2:               \
        return N_AVX2::F(__VA_ARGS__);
#else
#define SQUINT_CASE_AVX2(F, ...)
#endif
#if HWY_TARGETS & HWY_SSE4
#define SQUINT_CASE_SSE4(F, ...) \
    case HWY_SSE4:               \
        return N_SSE4::F(__VA_ARGS__);
#else
#define SQUINT_CASE_SSE4(F, ...)
#endif
#if HWY_TARGETS & HWY_NEON
#define SQUINT_CASE_NEON(F, ...) \
    case HWY_NEON:               \
        return N_NEON::F(__VA_ARGS__);
#else
#define SQUINT_CASE_NEON(F, ...)
#endif
#if HWY_TARGETS & HWY_EMU128
#define SQUINT_CASE_EMU128(F, ...) \
    case HWY_EMU128:               \
        return N_EMU128::F(__VA_ARGS__);
#else
#define SQUINT_CASE_EMU128(F, ...)
#endif
#if HWY_TARGETS & HWY_SCALAR  // in EMU128's place where the compiler gets that wrong (g++ before 12.3)
#define SQUINT_CASE_SCALAR(F, ...) \
    case HWY_SCALAR:               \
        return N_SCALAR::F(__VA_ARGS__);
#else
#define SQUINT_CASE_SCALAR(F, ...)
#endif
#define SQUINT_CALL_TARGET(TARGET, F, ...) \
    switch (TARGET) {                      \
        SQUINT_CASE_AVX3(F, __VA_ARGS__)   \
        SQUINT_CASE_AVX2(F, __VA_ARGS__)   \
        SQUINT_CASE_SSE4(F, __VA_ARGS__)   \
        SQUINT_CASE_NEON(F, __VA_ARGS__)   \
        SQUINT_CASE_EMU128(F, __VA_ARGS__) \
        SQUINT_CASE_SCALAR(F, __VA_ARGS__) \
    }
