#include "core/color_spaces.h"

#include "core/portable_math.h"
#include "core/srgb.h"

#include <algorithm>
#include <cmath>

namespace squint {
namespace {

constexpr double kPi = 0x1.921fb54442d18p+1;

Vec3 mixed(const Vec3& a, const Vec3& b, double part) {
    return a + (b - a) * part;
}

// --- CIE L*a*b*, white D65 (IEC 61966-2-1, CIE 15) ---------------------------------------------------

constexpr Vec3 kWhite(0.9505, 1, 1.089);
constexpr double kLinearBelow = 216.0 / 24389;  // (6/29)^3

Vec3 lab_from_rgb(const Vec3& rgb) {
    const Vec3 c(linear_from_srgb(rgb.x), linear_from_srgb(rgb.y), linear_from_srgb(rgb.z));
    const auto f = [](double t) {
        return t > kLinearBelow ? portable::pow(t, 1.0 / 3) : t * (841.0 / 108) + 4.0 / 29;
    };
    const double x = f((0.4124 * c.x + 0.3576 * c.y + 0.1805 * c.z) / kWhite.x),
                 y = f(0.2126 * c.x + 0.7152 * c.y + 0.0722 * c.z),
                 z = f((0.0193 * c.x + 0.1192 * c.y + 0.9505 * c.z) / kWhite.z);
    return {116 * y - 16, 500 * (x - y), 200 * (y - z)};
}

Vec3 rgb_from_lab(const Vec3& lab) {
    const auto cube = [](double t) {
        return t * t * t > kLinearBelow ? t * t * t : (t - 4.0 / 29) * (108.0 / 841);
    };
    const double fy = (lab.x + 16) / 116;
    const double x = kWhite.x * cube(fy + lab.y / 500), y = cube(fy), z = kWhite.z * cube(fy - lab.z / 200);
    Vec3 c(3.2406 * x - 1.5372 * y - 0.4986 * z, -0.9689 * x + 1.8758 * y + 0.0415 * z,
           0.0557 * x - 0.2040 * y + 1.0570 * z);
    // Outside the display's range as VTK does: scales down what is brighter than white, cuts off below 0.
    Vec3 rgb;
    for (int i = 0; i < 3; ++i) rgb[i] = c[i] > 0 ? srgb_from_linear(c[i]) : 0;
    return rgb / std::max({rgb.x, rgb.y, rgb.z, 1.0});
}

// --- HSV (Smith 1978), each 0 to 1 -------------------------------------------------------------------

Vec3 hsv_from_rgb(const Vec3& c) {
    const double most = std::max({c.x, c.y, c.z}), span = most - std::min({c.x, c.y, c.z});
    if (!(span > 0)) return {0, 0, most};
    double hue = most == c.x   ? (c.y - c.z) / span
                 : most == c.y ? 2 + (c.z - c.x) / span
                               : 4 + (c.x - c.y) / span;
    hue /= 6;
    return {hue < 0 ? hue + 1 : hue, span / most, most};
}

Vec3 rgb_from_hsv(const Vec3& hsv) {
    const auto part = [&](double from_red) {  // 0 at the hue; 1 from two sixths away on
        const double sixths = hsv.x * 6 + from_red, turn = sixths - 6 * std::floor(sixths / 6);
        return std::clamp(std::min(turn, 4 - turn), 0.0, 1.0);
    };
    const auto channel = [&](double n) { return hsv.z * (1 - hsv.y * part(n)); };
    return {channel(5), channel(3), channel(1)};
}

Vec3 between_hsv(const Vec3& a, const Vec3& b, double part, bool wrapped) {
    Vec3 from = hsv_from_rgb(a), to = hsv_from_rgb(b);
    if (wrapped && std::fabs(from.x - to.x) > 0.5) (from.x > to.x ? from.x : to.x) -= 1;
    Vec3 hsv = mixed(from, to, part);
    if (hsv.x < 0) hsv.x += 1;
    return rgb_from_hsv(hsv);
}

// --- Msh, polar L*a*b* (Moreland 2009) ---------------------------------------------------------------

/// The angle of (x, y), -pi to pi: Newton's method from the nearest eighth of a turn, for sines that are the same on
/// every processor.
double angle_of(double y, double x) {
    const double length = std::sqrt(x * x + y * y);
    if (!(length > 0)) return 0;
    double angle = std::fabs(y) > std::fabs(x) ? (y > 0 ? kPi / 2 : -kPi / 2)
                   : x > 0                     ? 0
                   : y < 0                     ? -kPi
                                               : kPi;
    for (int i = 0; i < 8; ++i) {
        const double c = portable::cos(angle), s = portable::sin(angle);
        angle += (y * c - x * s) / (x * c + y * s);
    }
    return std::clamp(angle, -kPi, kPi);
}

struct Msh {
    double m, s, h;  // magnitude, saturation (an angle from grey), hue
};
constexpr double kSaturated = 0.05;

Msh msh_from_lab(const Vec3& lab) {
    const double m = std::sqrt(lab.dot(lab)), across = std::sqrt(lab.y * lab.y + lab.z * lab.z);
    const double s = m > 0.001 ? angle_of(across, lab.x) : 0;
    return {m, s, s > 0.001 ? angle_of(lab.z, lab.y) : 0};
}
Vec3 lab_from_msh(const Msh& c) {
    const double across = c.m * portable::sin(c.s);
    return {c.m * portable::cos(c.s), across * portable::cos(c.h), across * portable::sin(c.h)};
}

/// The hue given to an unsaturated colour of magnitude `m` beside `c`: it has none of its own.
double hue_beside(const Msh& c, double m) {
    if (c.m >= m - 0.1) return c.h;
    const double spin = c.s * std::sqrt(m * m - c.m * c.m) / (c.m * portable::sin(c.s));
    return c.h > -0.3 * kPi ? c.h + spin : c.h - spin;
}

Vec3 between_diverging(const Vec3& a, const Vec3& b, double part) {
    Msh from = msh_from_lab(lab_from_rgb(a)), to = msh_from_lab(lab_from_rgb(b));
    double apart = std::fabs(from.h - to.h);
    apart = std::min(apart, 2 * kPi - apart);
    if (from.s > kSaturated && to.s > kSaturated && apart > 0.33 * kPi) {
        const double white = std::max({from.m, to.m, 88.0});
        if (part < 0.5)
            to = {white, 0, 0}, part = 2 * part;
        else
            from = {white, 0, 0}, part = 2 * part - 1;
    }
    if (from.s < kSaturated && to.s > kSaturated)
        from.h = hue_beside(to, from.m);
    else if (to.s < kSaturated && from.s > kSaturated)
        to.h = hue_beside(from, to.m);
    const auto mix = [part](double x, double y) { return x + (y - x) * part; };
    return rgb_from_lab(lab_from_msh({mix(from.m, to.m), mix(from.s, to.s), mix(from.h, to.h)}));
}

}  // namespace

Vec3 color_between(ColorSpace space, const Vec3& a, const Vec3& b, double part) {
    switch (space) {
        case ColorSpace::rgb:
            return mixed(a, b, part);
        case ColorSpace::hsv:
        case ColorSpace::hsv_wrapped:
            return between_hsv(a, b, part, space == ColorSpace::hsv_wrapped);
        case ColorSpace::lab:
            return rgb_from_lab(mixed(lab_from_rgb(a), lab_from_rgb(b), part));
        case ColorSpace::diverging:
            return between_diverging(a, b, part);
        case ColorSpace::step:
            return b;
    }
    return b;
}

}  // namespace squint
