// Procedural volumes: scalar fields over the unit cube, written once over a number type.  Doubles give a
// field's value, dual numbers its exact gradient as well.
#include "core/procedural.h"

#include "core/error.h"
#include "core/parallel.h"
#include "core/portable_math.h"
#include "core/volume_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace squint {
namespace {

constexpr double kPi = 3.14159265358979323846;

/// A value and its derivatives by x, y and z (forward differentiation).
struct Dual {
    double value = 0;
    Vec3 slope{0, 0, 0};

    Dual(double constant) : value(constant) {}  // NOLINT: numbers are dual numbers without a slope
    Dual(double v, const Vec3& s) : value(v), slope(s) {}

    friend Dual operator+(const Dual& a, const Dual& b) { return {a.value + b.value, a.slope + b.slope}; }
    friend Dual operator-(const Dual& a, const Dual& b) { return {a.value - b.value, a.slope - b.slope}; }
    friend Dual operator-(const Dual& a) { return {-a.value, -a.slope}; }
    friend Dual operator*(const Dual& a, const Dual& b) {
        return {a.value * b.value, a.slope * b.value + b.slope * a.value};
    }
    friend Dual operator/(const Dual& a, const Dual& b) {
        const double value = a.value / b.value;
        return {value, (a.slope - b.slope * value) / b.value};
    }
};

double value_of(double x) {
    return x;
}
double value_of(const Dual& x) {
    return x.value;
}

double sqrt(double x) {
    return std::sqrt(x);
}
double sin(double x) {
    return portable::sin(x);
}
double cos(double x) {
    return portable::cos(x);
}
/// At 0 the slope counts as 0: each field here that meets it depends on the square alone.
Dual sqrt(const Dual& x) {
    const double root = std::sqrt(x.value);
    return {root, root > 0 ? x.slope * (0.5 / root) : Vec3(0)};
}
Dual sin(const Dual& x) {
    return {portable::sin(x.value), x.slope * portable::cos(x.value)};
}
Dual cos(const Dual& x) {
    return {portable::cos(x.value), x.slope * -portable::sin(x.value)};
}

template <class S>
struct Point {
    S x, y, z;

    friend Point operator-(const Point& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
    friend Point operator/(const Point& a, const Vec3& b) { return {a.x / b.x, a.y / b.y, a.z / b.z}; }
};
template <class S>
S squared_length(const Point<S>& p) {
    return p.x * p.x + p.y * p.y + p.z * p.z;
}

// --- Shapes: distances to a surface, negative inside, exact near it to first order -------------------------

/// 0 below 0, 1 above 1, between them 6 t^5 - 15 t^4 + 10 t^3: two continuous derivatives.
template <class S>
S smooth_step(const S& t) {
    if (value_of(t) <= 0) return S(0);
    if (value_of(t) >= 1) return S(1);
    return t * t * t * (t * (t * S(6) - S(15)) + S(10));
}
/// From 0 outside to 1 inside, `width` across and centred on the surface.
template <class S>
S inside(const S& distance, double width) {
    return smooth_step(S(0.5) - distance / S(width));
}
/// The nearer of two surfaces, blended where they are less than `blend` apart (one continuous derivative).
template <class S>
S join(const S& a, const S& b, double blend) {
    const S apart = (a - b) / S(blend);
    if (value_of(apart) >= 1) return b;
    if (value_of(apart) <= -1) return a;
    const S closeness = S(1) - (value_of(apart) < 0 ? -apart : apart);
    return (value_of(apart) < 0 ? a : b) - closeness * closeness * S(blend / 4);
}
template <class S>
S cut(const S& a, const S& b, double blend) {  // a without b
    return -join(-a, b, blend);
}
template <class S>
S ball(const Point<S>& p, const Vec3& center, double radius) {
    return sqrt(squared_length(p - center)) - S(radius);
}
/// |k| (|k| - 1) / |gradient of k|, k = p / radii: the distance to first order near the surface.
template <class S>
S ellipsoid(const Point<S>& p, const Vec3& center, const Vec3& radii) {
    const Point<S> scaled = (p - center) / radii;
    const S length = sqrt(squared_length(scaled));
    if (value_of(length) < 1e-6)
        return S(-std::min(radii.x, std::min(radii.y, radii.z)));  // 0 / 0 at the centre
    return length * (length - S(1)) / sqrt(squared_length(scaled / radii));
}
/// Where ellipsoid() is certainly above `above` or below `-below`, found without its roots and divisions: it
/// is (|k| - 1) times a length of at least the smallest radius.
class EllipsoidBounds {
  public:
    EllipsoidBounds(const Vec3& center, const Vec3& radii, double above, double below)
        : center_(center), per_radius_(1 / radii.x, 1 / radii.y, 1 / radii.z) {
        constexpr double kRounding = 1e-9;
        const double least = std::min(radii.x, std::min(radii.y, radii.z));
        outer_ = (1 + above / least) * (1 + above / least) + kRounding;
        inner_ = below < least ? (1 - below / least) * (1 - below / least) - kRounding : 0;
    }
    bool above(const Vec3& p) const { return squared_k(p) > outer_; }
    bool below(const Vec3& p) const { return squared_k(p) < inner_; }

  private:
    double squared_k(const Vec3& p) const {
        const Vec3 k = (p - center_) * per_radius_;
        return k.dot(k);
    }
    Vec3 center_, per_radius_;
    double outer_, inner_;  // of squared |k|
};

/// A tube with round ends from a to b; its radius changes from ra to rb.
template <class S>
S tube(const Point<S>& p, const Vec3& a, double ra, const Vec3& b, double rb) {
    const Vec3 axis = b - a;
    const Point<S> from = p - a;
    S along = (from.x * S(axis.x) + from.y * S(axis.y) + from.z * S(axis.z)) / S(axis.dot(axis));
    if (value_of(along) < 0) along = S(0);
    if (value_of(along) > 1) along = S(1);
    const Point<S> off{from.x - along * S(axis.x), from.y - along * S(axis.y), from.z - along * S(axis.z)};
    return sqrt(squared_length(off)) - (S(ra) + along * S(rb - ra));
}

// --- The phantom: a head, x to its left, y to its back, z up; coordinates -1 to 1 --------------------------

struct Segment {
    Vec3 a;
    double ra;
    Vec3 b;
    double rb;
    // Beyond `reach` from the middle the head has no surface: skip the square roots.
    Vec3 middle = (a + b) * 0.5;
    double reach = (b - a).length() * 0.5 + ra + 0.1;
};
/// The vessels of one half of the brain: a trunk, a ring around the middle, and branches that get thinner.
constexpr int kSegments = 31;
const std::array<Segment, kSegments>& vessel_tree() {
    static const std::array<Segment, kSegments> tree{{
        {{0.10, 0.02, -0.16}, .034, {0.12, 0.00, -0.04}, .032},  // carotid
        {{0.12, 0.00, -0.04}, .032, {0.12, -0.03, 0.06}, .030},
        {{0.12, -0.03, 0.06}, .028, {0.07, -0.16, 0.12}, .024},  // anterior
        {{0.07, -0.16, 0.12}, .024, {0.05, -0.28, 0.20}, .023},
        {{0.05, -0.28, 0.20}, .023, {0.05, -0.36, 0.32}, .021},
        {{0.05, -0.36, 0.32}, .021, {0.06, -0.33, 0.46}, .018},
        {{0.06, -0.33, 0.46}, .018, {0.06, -0.22, 0.56}, .016},
        {{0.06, -0.22, 0.56}, .016, {0.07, -0.06, 0.62}, .013},
        {{0.05, -0.28, 0.20}, .018, {0.14, -0.40, 0.26}, .014},
        {{0.14, -0.40, 0.26}, .014, {0.19, -0.39, 0.38}, .011},
        {{0.06, -0.33, 0.46}, .015, {0.16, -0.28, 0.53}, .011},
        {{0.06, -0.22, 0.56}, .013, {0.17, -0.10, 0.60}, .010},
        {{0.12, -0.03, 0.06}, .028, {0.22, -0.07, 0.09}, .026},  // middle
        {{0.22, -0.07, 0.09}, .026, {0.31, -0.04, 0.14}, .024},
        {{0.31, -0.04, 0.14}, .024, {0.37, 0.03, 0.21}, .022},
        {{0.37, 0.03, 0.21}, .018, {0.40, -0.06, 0.30}, .015},
        {{0.40, -0.06, 0.30}, .015, {0.36, -0.16, 0.40}, .012},
        {{0.36, -0.16, 0.40}, .012, {0.27, -0.18, 0.51}, .010},
        {{0.37, 0.03, 0.21}, .020, {0.40, 0.14, 0.29}, .017},
        {{0.40, 0.14, 0.29}, .017, {0.36, 0.22, 0.40}, .014},
        {{0.36, 0.22, 0.40}, .014, {0.26, 0.24, 0.51}, .011},
        {{0.40, 0.14, 0.29}, .013, {0.37, 0.29, 0.28}, .010},
        {{0.31, -0.04, 0.14}, .016, {0.34, -0.20, 0.17}, .013},
        {{0.34, -0.20, 0.17}, .013, {0.31, -0.32, 0.25}, .010},
        {{0.12, -0.03, 0.06}, .026, {0.11, 0.12, 0.06}, .024},  // posterior
        {{0.11, 0.12, 0.06}, .024, {0.15, 0.26, 0.09}, .021},
        {{0.15, 0.26, 0.09}, .021, {0.16, 0.39, 0.15}, .018},
        {{0.16, 0.39, 0.15}, .018, {0.12, 0.49, 0.25}, .015},
        {{0.12, 0.49, 0.25}, .015, {0.10, 0.47, 0.39}, .012},
        {{0.10, 0.47, 0.39}, .012, {0.09, 0.38, 0.50}, .010},
        {{0.16, 0.39, 0.15}, .014, {0.28, 0.42, 0.17}, .011},
    }};
    return tree;
}

template <class S>
S vessels(const Point<S>& p) {
    Point<S> half = p;  // the two halves mirror each other, but for an aneurysm on the left
    if (value_of(p.x) < 0) half.x = -p.x;
    S distance = join(ball(p, {0.24, -0.10, 0.12}, 0.055),
                      tube(p, {-0.07, -0.16, 0.12}, .018, {0.07, -0.16, 0.12}, .018), 0.01);
    for (const Segment& s : vessel_tree()) {
        if (value_of(squared_length(half - s.middle)) > s.reach * s.reach) continue;
        distance = join(distance, tube(half, s.a, s.ra, s.b, s.rb), 0.008);
    }
    return distance;
}

struct Ellipsoid {
    Vec3 center, radii;
};
const Ellipsoid kCranium{{0, 0.06, 0.22}, {0.62, 0.76, 0.66}}, kFace{{0, -0.32, -0.25}, {0.42, 0.42, 0.56}},
    kEar{{0.64, 0.08, -0.02}, {0.07, 0.12, 0.17}}, kEye{{0.17, -0.70, -0.08}, {0.11, 0.06, 0.06}},
    kMouth{{0, -0.74, -0.43}, {0.12, 0.05, 0.02}};
template <class S>
S ellipsoid(const Point<S>& p, const Ellipsoid& e) {
    return ellipsoid(p, e.center, e.radii);
}

template <class S>
S head_surface(const Point<S>& p) {
    const S cranium = ellipsoid(p, kCranium), face = ellipsoid(p, kFace);
    const S nose = tube(p, {0, -0.72, -0.08}, .045, {0, -0.80, -0.24}, .07);
    const S neck = tube(p, {0, 0.14, -0.40}, .36, {0, 0.20, -1.5}, .36);
    Point<S> half = p;
    if (value_of(p.x) < 0) half.x = -p.x;
    const S ear = ellipsoid(half, kEar);
    const S eye = ellipsoid(half, kEye);
    const S head = join(join(join(join(cranium, face, 0.20), neck, 0.20), nose, 0.06), ear, 0.05);
    const S mouth = ellipsoid(p, kMouth);
    return cut(cut(head, eye, 0.05), mouth, 0.03);
}

template <class S>
S skull_outside(const Point<S>& p) {
    const S vault = ellipsoid(p, {0, 0.06, 0.22}, {0.54, 0.68, 0.58});
    const S cheeks = ellipsoid(p, {0, -0.30, -0.16}, {0.33, 0.34, 0.36});
    Point<S> half = p;
    if (value_of(p.x) < 0) half.x = -p.x;
    const S orbit = ellipsoid(half, {0.17, -0.60, -0.10}, {0.12, 0.16, 0.10});
    const S nasal = ellipsoid(p, {0, -0.60, -0.24}, {0.065, 0.16, 0.12});
    const S ramus = tube(half, {0.30, -0.08, -0.22}, .050, {0.28, -0.13, -0.42}, .050);
    const S angle = tube(half, {0.28, -0.13, -0.42}, .050, {0.21, -0.28, -0.54}, .055);
    const S side = tube(half, {0.21, -0.28, -0.54}, .055, {0.11, -0.42, -0.60}, .060);
    const S chin = tube(half, {0.11, -0.42, -0.60}, .060, {0.0, -0.47, -0.61}, .065);
    const S jaw = join(join(join(ramus, angle, 0.01), side, 0.01), chin, 0.01);
    const S spine = tube(p, {0, 0.20, -0.42}, .13, {0, 0.24, -1.5}, .13);
    const S canal = tube(p, {0, 0.26, -0.30}, .05, {0, 0.30, -1.5}, .05);
    const S skull = cut(cut(join(vault, cheeks, 0.10), orbit, 0.02), nasal, 0.02);
    return cut(join(join(skull, jaw, 0.02), spine, 0.04), canal, 0.02);
}

/// Levels rise inwards, air < skin < tissue < bone < brain < vessel, and each surface separates two
/// neighbours: a transfer function that shows one level does not meet it again between two others.
constexpr double kSkin = 0.16, kTissue = 0.32, kBone = 0.55, kBrain = 0.72, kVessel = 0.94;
constexpr double kEdge = 0.030;  // of 2: transitions are 2 voxels wide at 128, 4 at 256

/// Most voxels only need to know that head_surface() is beyond kEdge or below -0.06, where skin and flesh are
/// whole.  A join lies below both parts by at most a quarter of its blend, a cut above by as much.
enum class Head { outside, near_the_surface, inside };
Head part_of_head(const Vec3& p) {
    constexpr double kOut = kEdge + (0.20 + 0.20 + 0.06 + 0.05) / 4, kIn = 0.06 + (0.05 + 0.03) / 4 + 1e-3;
    static const auto bounds = [](const Ellipsoid& e, double above) {
        return EllipsoidBounds(e.center, e.radii, above, kIn);
    };
    static const EllipsoidBounds cranium = bounds(kCranium, kOut), face = bounds(kFace, kOut),
                                 ear = bounds(kEar, kOut), eye = bounds(kEye, kIn),
                                 mouth = bounds(kMouth, kIn);
    const Vec3 half(std::fabs(p.x), p.y, p.z);
    if (cranium.below(p)) return eye.above(half) && mouth.above(p) ? Head::inside : Head::near_the_surface;
    if (!cranium.above(p) || !face.above(p) || !ear.above(half)) return Head::near_the_surface;
    // The nose lies within a ball about its middle, the neck within a cylinder below its upper end.
    const Vec3 nose = p - Vec3(0, -0.76, -0.16);
    constexpr double kNose = 0.09 + 0.07 + kOut, kNeck = 0.36 + kOut;
    const double beside = p.y - std::clamp(p.y, 0.14, 0.20);
    const bool off_neck = p.z > -0.40 + kNeck || p.x * p.x + beside * beside > kNeck * kNeck;
    return nose.dot(nose) > kNose * kNose && off_neck ? Head::outside : Head::near_the_surface;
}

template <class S>
S phantom(const S& x, const S& y, const S& z) {
    const Point<S> p{x * S(2) - S(1), y * S(2) - S(1), z * S(2) - S(1)};
    const Head part = part_of_head({value_of(p.x), value_of(p.y), value_of(p.z)});
    if (part == Head::outside) return S(0);
    S skin(1), flesh(1);
    if (part == Head::near_the_surface) {
        const S head = head_surface(p);
        if (value_of(head) > kEdge) return S(0);
        skin = inside(head, kEdge), flesh = inside(head + S(0.045), kEdge);
        if (value_of(head) > -0.03) return skin * S(kSkin) + flesh * S(kTissue - kSkin);
    }
    S value = skin * S(kSkin) + flesh * S(kTissue - kSkin);

    // Off the middle of the vault: bone is thick at the back and the base, thin at the front and the temples.
    const S brain = ellipsoid(p, {0, 0.035, 0.235}, {0.505, 0.625, 0.535});
    const bool deep = value_of(brain) < -kEdge;  // within the skull wherever its outside is
    const S within_skull = deep ? S(1) : inside(join(skull_outside(p), brain, 1e-3), kEdge);
    value = value + within_skull * S(kBone - kTissue);
    if (value_of(brain) > kEdge) return value;
    value = value + inside(brain, kEdge) * S(kBrain - kBone);
    if (value_of(brain) > -0.03) return value;
    return value + inside(vessels(p), kEdge) * S(kVessel - kBrain);
}

// --- The other fields --------------------------------------------------------------------------------------

/// 1 at the centre, 0 at the distance 0.5 and beyond.
template <class S>
S sphere(const S& x, const S& y, const S& z) {
    return smooth_step(S(1) - sqrt(squared_length(Point<S>{x, y, z} - Vec3(0.5))) * S(2));
}

/// The ball with bumps: its distance is changed by three octaves of products of sines.
template <class S>
S noisy_sphere(const S& x, const S& y, const S& z) {
    const auto bumps = [&](double frequency, double phase) {
        const auto wave = [&](const S& a, double shift) {
            return sin(a * S(2 * kPi * frequency) + S(shift));
        };
        return wave(x + y * S(0.31), phase) * wave(y + z * S(0.37), 2 * phase) *
               wave(z + x * S(0.29), 3 * phase);
    };
    const S noise = bumps(4.1, 0.7) * S(0.012) + bumps(8.3, 1.9) * S(0.006) + bumps(15.7, 3.1) * S(0.003);
    const S radius = sqrt(squared_length(Point<S>{x, y, z} - Vec3(0.5))) + noise;
    return value_of(radius) >= 0.5 ? S(0) : smooth_step(S(1) - radius * S(2));
}

/// Marschner and Lobb 1994, section 5: f_M = 6, alpha = 0.25, over [-1, 1]^3.
template <class S>
S marschner_lobb(const S& x, const S& y, const S& z) {
    constexpr double kFrequency = 6, kAlpha = 0.25;
    const S px = x * S(2) - S(1), py = y * S(2) - S(1), pz = z * S(2) - S(1);
    const S radius = sqrt(px * px + py * py);
    const S ripple = cos(cos(radius * S(kPi / 2)) * S(2 * kPi * kFrequency));
    return (S(1) - sin(pz * S(kPi / 2)) + (S(1) + ripple) * S(kAlpha)) / S(2 * (1 + kAlpha));
}

/// Five nested shells, brighter and thinner inwards, with gaps between: (1 - t^2)^3 across a shell.
template <class S>
S shells(const S& x, const S& y, const S& z) {
    constexpr double kRadius[] = {0.44, 0.36, 0.28, 0.20, 0.12},
                     kHalf[] = {0.020, 0.016, 0.013, 0.010, 0.008};
    constexpr double kLevel[] = {0.2, 0.4, 0.6, 0.8, 1.0};
    const S radius = sqrt(squared_length(Point<S>{x, y, z} - Vec3(0.5)));
    for (int i = 0; i < 5; ++i) {
        const S across = (radius - S(kRadius[i])) / S(kHalf[i]);
        const S profile = S(1) - across * across;
        if (value_of(profile) > 0) return profile * profile * profile * S(kLevel[i]);
    }
    return S(0);
}

template <class S>
S ramp(const S& x, const S&, const S&) {
    return x;
}
template <class S>
S constant(const S&, const S&, const S&) {
    return S(0.5);
}
template <class S>
S fog(const S&, const S&, const S&) {
    return S(1.0 / 255);
}

/// (T(x) + T(y) + T(z) + 3) / 6 over [-1, 1]^3 with the cubic T(t) = 4 t^3 - 3 t: its isosurfaces open, close
/// and split.
template <class S>
S polynomial(const S& x, const S& y, const S& z) {
    const auto cubic = [](const S& unit) {
        const S t = unit * S(2) - S(1);
        return t * (t * t * S(4) - S(3));
    };
    return (cubic(x) + cubic(y) + cubic(z) + S(3)) / S(6);
}

/// A generic lambda f(x, y, z) over any number type -> value and gradient.
template <class F>
ProceduralField field(std::string name, std::string description, int bits, std::int64_t size, F f) {
    return {std::move(name),
            std::move(description),
            bits,
            size,
            [f](const Vec3& p) { return f(p.x, p.y, p.z); },
            [f](const Vec3& p) {
                return f(Dual(p.x, {1, 0, 0}), Dual(p.y, {0, 1, 0}), Dual(p.z, {0, 0, 1})).slope;
            }};
}

}  // namespace

const std::vector<ProceduralField>& procedural_fields() {
    static const std::vector<ProceduralField> fields{
        field("phantom", "a head: skin, fog-like tissue, a skull thick and thin, a brain with vessels", 12,
              128, [](auto x, auto y, auto z) { return phantom(x, y, z); }),
        field("sphere", "a smooth ball: 1 at the centre, 0 from half the side on", 12, 128,
              [](auto x, auto y, auto z) { return sphere(x, y, z); }),
        field("marschner_lobb", "the test signal of Marschner and Lobb, f_M = 6, alpha = 0.25", 8, 41,
              [](auto x, auto y, auto z) { return marschner_lobb(x, y, z); }),
        field("shells", "five thin nested shells, brighter and thinner inwards", 12, 128,
              [](auto x, auto y, auto z) { return shells(x, y, z); }),
        field("ramp", "x, from 0 to full scale", 8, 128,
              [](auto x, auto y, auto z) { return ramp(x, y, z); }),
        field("constant", "half of full scale everywhere", 8, 128,
              [](auto x, auto y, auto z) { return constant(x, y, z); }),
        field("fog", "1/255 of full scale everywhere: the scalar 1 at 8 bits", 8, 128,
              [](auto x, auto y, auto z) { return fog(x, y, z); }),
        field("polynomial", "a sum of cubics whose isosurfaces open, close and split", 8, 64,
              [](auto x, auto y, auto z) { return polynomial(x, y, z); }),
        field("noisy_sphere", "the ball with bumps of three sizes", 12, 128,
              [](auto x, auto y, auto z) { return noisy_sphere(x, y, z); }),
    };
    return fields;
}

const ProceduralField* find_procedural(std::string_view name) {
    for (const ProceduralField& field : procedural_fields())
        if (field.name == name) return &field;
    return nullptr;
}

namespace {

/// The coordinate of a voxel centre in [0, 1]; the only voxel of an axis lies at 0.5.
double unit_coordinate(std::int64_t index, std::int64_t size) {
    return size == 1 ? 0.5 : static_cast<double>(index) / static_cast<double>(size - 1);
}

template <class Scalar>
void sample(const ProceduralField& field, const Index3& dims, double levels, Scalar* voxels) {
    in_parallel(dims.z, [&](std::int64_t z) {
        Scalar* at = voxels + z * dims.y * dims.x;
        Vec3 p{0, 0, unit_coordinate(z, dims.z)};
        for (std::int64_t y = 0; y < dims.y; ++y) {
            p.y = unit_coordinate(y, dims.y);
            for (std::int64_t x = 0; x < dims.x; ++x) {
                p.x = unit_coordinate(x, dims.x);
                const double value = std::clamp(field.value(p), 0.0, 1.0);
                *at++ = static_cast<Scalar>(value * levels + 0.5);
            }
        }
    });
}

}  // namespace

Volume make_procedural(const ProceduralField& field, Index3 dims, int bits, const Vec3& spacing) {
    if (bits < 1 || bits > 16)
        throw InputError(fmt::format("{}: bits is {}, but 1 to 16 are allowed", field.name, bits));
    check_spacing(spacing, field.name);
    Volume volume;
    volume.name = field.name;
    volume.dims = dims;
    volume.spacing = spacing;
    volume.type = bits <= 8 ? ScalarType::u8 : ScalarType::u16;
    volume.scalar_bits = bits;
    const std::shared_ptr<void> voxels =
        allocate_voxels(checked_bytes(dims, volume.scalar_bytes(), field.name), field.name);
    const double levels = (1 << bits) - 1;
    if (volume.type == ScalarType::u8) sample(field, dims, levels, static_cast<std::uint8_t*>(voxels.get()));
    if (volume.type == ScalarType::u16)
        sample(field, dims, levels, static_cast<std::uint16_t*>(voxels.get()));
    volume.data = voxels;
    measure(volume);
    return volume;
}

}  // namespace squint
