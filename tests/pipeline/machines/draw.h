// Random choices from a seed, the same on every machine: tests of random scenes draw by them.
#pragma once

#include "core/procedural.h"
#include "scene/scene.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <iterator>
#include <random>
#include <string>

namespace squint {

class Draw {
  public:
    explicit Draw(unsigned seed) : random_(seed) {}
    /// low to high, both included.
    std::int64_t between(std::int64_t low, std::int64_t high) {
        return low + static_cast<std::int64_t>(random_() % static_cast<std::uint64_t>(high - low + 1));
    }
    bool once_in(int n) { return between(1, n) == 1; }
    double real(double low, double high) {
        return low + (high - low) * static_cast<double>(random_() >> 11) * 0x1p-53;
    }
    template <class T>
    T one_of(std::initializer_list<T> values) {
        return values.begin()[between(0, static_cast<std::int64_t>(values.size()) - 1)];
    }
    template <class E>
    E any_of() {
        return static_cast<E>(between(0, static_cast<std::int64_t>(std::size(EnumNames<E>::names)) - 1));
    }
    Vec3 vector(double low, double high) { return {real(low, high), real(low, high), real(low, high)}; }

  private:
    std::mt19937_64 random_;
};

/// White noise: every cell differs from its neighbours as much as a cell can.
inline double noise_at(const Vec3& p) {
    auto bits = static_cast<std::uint64_t>(p.x * 1e6) * 0x9e3779b97f4a7c15u ^
                static_cast<std::uint64_t>(p.y * 1e6) * 0xc2b2ae3d27d4eb4fu ^
                static_cast<std::uint64_t>(p.z * 1e6) * 0x165667b19e3779f9u;
    bits = (bits ^ bits >> 31) * 0xbf58476d1ce4e5b9u;
    return static_cast<double>((bits ^ bits >> 29) >> 11) * 0x1p-53;
}

inline const ProceduralField& noise_field() {
    static const ProceduralField noise{"noise", "", 8, 16, noise_at, [](const Vec3&) { return Vec3(); }};
    return noise;
}

/// One of the built-in fields, or noise: `noises` times as likely as one of them.
inline const ProceduralField& draw_field(Draw& draw, int noises) {
    const auto& fields = procedural_fields();
    const auto which =
        static_cast<std::size_t>(draw.between(0, static_cast<std::int64_t>(fields.size()) - 1 + noises));
    return which < fields.size() ? fields[which] : noise_field();
}

/// A wire's setting with few fraction bits, 2 to 9 where it has so many, cut or rounded.
inline std::string draw_coarse(Draw& draw, Spec spec) {
    spec.format.fraction_bits = std::min(static_cast<int>(draw.between(2, 9)), spec.format.fraction_bits);
    spec.rounding = draw.one_of({Rounding::trn, Rounding::rnd_conv});
    return to_string(spec);
}

}  // namespace squint
