// Rays of a camera and their chords through a box, over a real word D: single doubles, or as many as a vector
// holds.  Uses only + - * / sqrt and comparisons: the same bits on every CPU.
#if defined(SQUINT_CORE_RAYS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef SQUINT_CORE_RAYS_INL_H
#undef SQUINT_CORE_RAYS_INL_H
#else
#define SQUINT_CORE_RAYS_INL_H
#endif

#include "core/camera.h"

#include <hwy/highway.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

HWY_BEFORE_NAMESPACE();
namespace squint::HWY_NAMESPACE {

// ----------------------------------------------------------------------------------------- doubles

HWY_INLINE double choose(bool condition, double yes, double no) {
    return condition ? yes : no;
}
HWY_INLINE double square_root(double x) {
    return std::sqrt(x);
}
HWY_INLINE double ceiling(double x) {
    return std::ceil(x);
}

/// Doubles side by side, as a vector.
struct Reals {
    using D = hwy::HWY_NAMESPACE::ScalableTag<double>;
    using V = hwy::HWY_NAMESPACE::Vec<D>;
    V v;
    Reals() = default;
    HWY_INLINE explicit Reals(double x) : v(hwy::HWY_NAMESPACE::Set(D(), x)) {}
    HWY_INLINE explicit Reals(V x) : v(x) {}
    static constexpr int count() { return static_cast<int>(HWY_LANES(double)); }
};
struct RealsMask {
    hwy::HWY_NAMESPACE::Mask<Reals::D> m;
};
HWY_INLINE Reals operator+(Reals a, Reals b) {
    return Reals(hwy::HWY_NAMESPACE::Add(a.v, b.v));
}
HWY_INLINE Reals operator-(Reals a, Reals b) {
    return Reals(hwy::HWY_NAMESPACE::Sub(a.v, b.v));
}
HWY_INLINE Reals operator*(Reals a, Reals b) {
    return Reals(hwy::HWY_NAMESPACE::Mul(a.v, b.v));
}
HWY_INLINE Reals operator/(Reals a, Reals b) {
    return Reals(hwy::HWY_NAMESPACE::Div(a.v, b.v));
}
HWY_INLINE RealsMask operator<(Reals a, Reals b) {
    return {hwy::HWY_NAMESPACE::Lt(a.v, b.v)};
}
HWY_INLINE RealsMask operator==(Reals a, Reals b) {
    return {hwy::HWY_NAMESPACE::Eq(a.v, b.v)};
}
HWY_INLINE RealsMask operator&(RealsMask a, RealsMask b) {
    return {hwy::HWY_NAMESPACE::And(a.m, b.m)};
}
HWY_INLINE RealsMask operator|(RealsMask a, RealsMask b) {
    return {hwy::HWY_NAMESPACE::Or(a.m, b.m)};
}
HWY_INLINE RealsMask operator!(RealsMask a) {
    return {hwy::HWY_NAMESPACE::Not(a.m)};
}
HWY_INLINE Reals choose(RealsMask condition, Reals yes, Reals no) {
    return Reals(hwy::HWY_NAMESPACE::IfThenElse(condition.m, yes.v, no.v));
}
HWY_INLINE Reals square_root(Reals x) {
    return Reals(hwy::HWY_NAMESPACE::Sqrt(x.v));
}
HWY_INLINE Reals ceiling(Reals x) {
    return Reals(hwy::HWY_NAMESPACE::Ceil(x.v));
}

/// A divisor of many numbers.  Division by a power of two becomes a multiplication, with the same result.
struct Divisor {
    double divisor, inverse;
    bool is_power_of_two;
    HWY_INLINE explicit Divisor(double x)
        : divisor(x),
          inverse(1 / x),
          is_power_of_two(std::bit_cast<std::uint64_t>(x) << 12 == 0 && 0x1p-1000 < x && x < 0x1p1000) {}
};
template <class D>
HWY_INLINE D operator/(D x, const Divisor& by) {
    return by.is_power_of_two ? x * D(by.inverse) : x / D(by.divisor);
}

/// Returns the first of two equal numbers, so that zeros of either sign come out alike in every word.
template <class D>
HWY_INLINE D lesser(D a, D b) {
    return choose(b < a, b, a);
}
template <class D>
HWY_INLINE D greater(D a, D b) {
    return choose(a < b, b, a);
}

// -------------------------------------------------------------------------------------------- rays

template <class D>
using RealVector = std::array<D, 3>;

/// v / |v|, or zero where |v| is too small to give a direction.
template <class D>
HWY_INLINE RealVector<D> unit_vector(const RealVector<D>& v) {
    const D squares = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    const auto none = squares < D(std::numeric_limits<double>::min());
    const D length = square_root(choose(none, D(1), squares));
    return {choose(none, D(0), v[0] / length), choose(none, D(0), v[1] / length),
            choose(none, D(0), v[2] / length)};
}

template <class D>
struct RayOf {
    RealVector<D> origin, direction;  // unit length
};

/// Camera::ray for columns and rows that are integers.
template <class D>
HWY_INLINE RayOf<D> ray_through(const Camera& camera, D column, D row) {
    const D scale(camera.half_height / camera.height);
    const D across = (D(2) * column + D(1) - D(camera.width)) * scale,
            above = (D(camera.height) - (D(2) * row + D(1))) * scale;
    const bool orthographic = camera.projection == Projection::orthographic;
    RealVector<D> moved;
    for (int a = 0; a < 3; ++a)
        moved[static_cast<std::size_t>(a)] = D(orthographic ? camera.eye[a] : camera.view[a]) +
                                             D(camera.right[a]) * across + D(camera.up[a]) * above;
    if (orthographic) return {moved, {D(camera.view.x), D(camera.view.y), D(camera.view.z)}};
    return {{D(camera.eye.x), D(camera.eye.y), D(camera.eye.z)}, unit_vector(moved)};
}

/// The part of a ray inside a box [low, high], as distances along the ray: both zero where there is none.
template <class D>
struct IntervalOf {
    D first, last;
};
template <class D>
HWY_INLINE IntervalOf<D> intersect_box(const RayOf<D>& ray, const Vec3& low, const Vec3& high) {
    IntervalOf<D> inside{D(0), D(std::numeric_limits<double>::infinity())};  // nothing behind the eye is seen
    auto outside = D(0) < D(0);
    for (int axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        const D origin = ray.origin[a], from(low[axis]), to(high[axis]);
        // A ray parallel to this pair of faces: a ray within a face counts as inside.
        const auto parallel = ray.direction[a] == D(0);
        outside = outside | (parallel & ((origin < from) | (to < origin)));
        const D direction = choose(parallel, D(1), ray.direction[a]);
        const D to_low = (from - origin) / direction, to_high = (to - origin) / direction;
        inside.first = choose(parallel, inside.first, greater(inside.first, lesser(to_low, to_high)));
        inside.last = choose(parallel, inside.last, lesser(inside.last, greater(to_low, to_high)));
    }
    const auto none = outside | !(inside.first < inside.last);
    return {choose(none, D(0), inside.first), choose(none, D(0), inside.last)};
}
/// The same for a box along axes of its own.
template <class D>
HWY_INLINE IntervalOf<D> intersect_turned_box(const RayOf<D>& ray, const TurnedBox& box) {
    RayOf<D> along;
    for (std::size_t a = 0; a < 3; ++a) {
        const D x(box.axes[a].x), y(box.axes[a].y), z(box.axes[a].z);
        along.origin[a] = x * ray.origin[0] + y * ray.origin[1] + z * ray.origin[2];
        along.direction[a] = x * ray.direction[0] + y * ray.direction[1] + z * ray.direction[2];
    }
    return intersect_box(along, box.low, box.high);
}

}  // namespace squint::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
