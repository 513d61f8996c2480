// All arithmetic of lanes, and the assertion that lanes are words; compiled once per SIMD target.
#if defined(SQUINT_FIXEDPOINT_WORDS_ALL_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_FIXEDPOINT_WORDS_ALL_LANES_INL_H
#undef SQUINT_FIXEDPOINT_WORDS_ALL_LANES_INL_H
#else
#define SQUINT_FIXEDPOINT_WORDS_ALL_LANES_INL_H
#endif

#include "fixedpoint/words/float_lanes-inl.h"
#include "fixedpoint/words/lane_quotients-inl.h"
#include "fixedpoint/words/lane_tables-inl.h"
#include "fixedpoint/words/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

static_assert(Word<Lanes<std::int32_t>> && Word<Lanes<std::int64_t>> && Word<Lanes<float>>);
static_assert(Word<Lanes<std::int32_t, KnownRescales::halves_up>> &&
              Word<Lanes<std::int32_t, KnownRescales::halves_to_even>>);
static_assert(RealWord<Lanes<float>>);

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
