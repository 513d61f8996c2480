// What a kernel may be compiled to know of a stage: one list a stage, asked of the plan (hold), promised to the
// compiler (assume), asserted in debug builds.  A fact that is promised is a fact that was asked: both come from
// the same line.
//
//     using Units = Facts<CompositingStage, Is<&CompositingStage::form, CompositingForm::w>,
//                         DropsBits<&CompositingStage::to_color, 15>>;
//
//     if (Units::hold(plan.compositing)) kernel = &composite_rows<Units>;     // where kernels are chosen
//
//     CompositingStage stage = plan.compositing;                              // in composite_rows<Facts>
//     Facts::assume(stage);
#pragma once

#include "fixedpoint/quantise.h"

#include <cassert>
#include <string>
#include <string_view>

namespace squint {

/// A member's own name, as the compiler spells it.
template <auto kMember>
constexpr std::string_view member_name() {
    std::string_view text = __PRETTY_FUNCTION__;  // "... kMember = &squint::ShadingStage::lights]", or so
    text = text.substr(text.find("kMember = ") + 10);
    text = text.substr(0, text.find_first_of(";,]"));
    while (!text.empty() && (text.back() == ')' || text.back() == ' ')) text.remove_suffix(1);
    return text.substr(text.rfind(':') + 1);
}

/// A member has one value.
template <auto kMember, auto kValue>
struct Is {
    template <class Stage>
    static bool holds(const Stage& s) {
        return s.*kMember == kValue;
    }
    template <class Stage>
    [[gnu::always_inline]] static inline void promise(Stage& s) {
        s.*kMember = kValue;
    }
    static std::string missing() { return std::string(member_name<kMember>()) + " has another value"; }
};

/// A member is no greater.
template <auto kMember, auto kMost>
struct AtMost {
    template <class Stage>
    static bool holds(const Stage& s) {
        return s.*kMember <= kMost;
    }
    template <class Stage>
    [[gnu::always_inline]] static inline void promise(Stage& s) {
        if (s.*kMember > kMost) __builtin_unreachable();
    }
    static std::string missing() { return std::string(member_name<kMember>()) + " is too large"; }
};

/// Two members are equal.
template <auto kMember, auto kOther>
struct Same {
    template <class Stage>
    static bool holds(const Stage& s) {
        return s.*kMember == s.*kOther;
    }
    template <class Stage>
    [[gnu::always_inline]] static inline void promise(Stage& s) {
        s.*kMember = s.*kOther;
    }
    static std::string missing() {
        return std::string(member_name<kMember>()) + " differs from " + std::string(member_name<kOther>());
    }
};

/// A Rescale drops bits, of a number of them where it is said, and meets no limit.
template <auto kMember, int kBits = 0>
struct DropsBits {
    template <class Stage>
    static bool holds(const Stage& s) {
        const Rescale& to = s.*kMember;
        return (kBits > 0 ? to.shift == kBits : to.shift > 0) && !to.limits;
    }
    template <class Stage>
    [[gnu::always_inline]] static inline void promise(Stage& s) {
        Rescale& to = s.*kMember;
        to.limits = false;
        if constexpr (kBits > 0) {
            to.shift = kBits;
        } else {
            if (to.shift <= 0) __builtin_unreachable();
        }
    }
    static std::string missing() {
        return std::string(member_name<kMember>()) + " meets its limits, or drops " +
               (kBits > 0 ? "other than " + std::to_string(kBits) + " bits" : std::string("no bits"));
    }
};

/// A Rescale passes its numbers on.
template <auto kMember>
struct DoesNothing {
    template <class Stage>
    static bool holds(const Stage& s) {
        return (s.*kMember).shift == 0 && !(s.*kMember).limits;
    }
    template <class Stage>
    [[gnu::always_inline]] static inline void promise(Stage& s) {
        (s.*kMember).limits = false, (s.*kMember).shift = 0;
    }
    static std::string missing() {
        return std::string(member_name<kMember>()) + " rounds, or meets its limits";
    }
};

/// A Rescale drops bits and meets no limit, or nothing flows through it where `kIdle` is set.
template <auto kMember, auto kIdle>
struct DropsBitsUnless {
    template <class Stage>
    static bool holds(const Stage& s) {
        return (s.*kMember).shift > 0 && (s.*kIdle || !(s.*kMember).limits);
    }
    template <class Stage>
    [[gnu::always_inline]] static inline void promise(Stage& s) {
        DropsBits<kMember>::promise(s);
    }
    static std::string missing() { return DropsBits<kMember>::missing(); }
};

/// A Rescale drops bits, and a clamp to [0, 1] that follows it makes its limits superfluous.  kFraction: the
/// member that says what one is.
template <auto kMember, auto kFraction>
struct DropsBitsBeforeClamp {
    template <class Stage>
    static bool holds(const Stage& s) {
        const Rescale& to = s.*kMember;
        return to.shift > 0 && !to.wraps && to.lowest <= 0 && to.highest >= std::int64_t{1} << s.*kFraction;
    }
    template <class Stage>
    [[gnu::always_inline]] static inline void promise(Stage& s) {
        DropsBits<kMember>::promise(s);
    }
    static std::string missing() {
        return std::string(member_name<kMember>()) + " drops no bits, wraps, or cannot hold [0, 1]";
    }
};

/// A Rescale's rounding.
template <auto kMember, Rounding kRounding>
struct Rounds {
    template <class Stage>
    static bool holds(const Stage& s) {
        return (s.*kMember).rounding == kRounding;
    }
    template <class Stage>
    [[gnu::always_inline]] static inline void promise(Stage& s) {
        (s.*kMember).rounding = kRounding;
    }
    static std::string missing() { return std::string(member_name<kMember>()) + " rounds otherwise"; }
};

/// Facts of one stage, all of them.
template <class S, class... Each>
struct Facts {
    using Stage = S;
    static bool hold(const Stage& s) { return (Each::holds(s) && ...); }
    /// The first of them that does not hold, in words; empty where all do.
    static std::string missing(const Stage& s) {
        std::string text;
        (void)((Each::holds(s) || (text = Each::missing(), false)) && ...);
        return text;
    }
    /// Only of a stage of which they hold.  `copy`: the caller's own, so that nothing it stores can change it.
    [[gnu::always_inline]] static inline void assume(Stage& copy) {
        assert(hold(copy));
        (Each::promise(copy), ...);
    }
    static constexpr bool kNone = sizeof...(Each) == 0;
    /// These and more.
    template <class... More>
    using And = Facts<S, Each..., More...>;
};
/// Nothing is known.
template <class S>
using NoFacts = Facts<S>;

}  // namespace squint
