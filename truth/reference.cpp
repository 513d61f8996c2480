#include "truth/reference.h"

#include "core/parallel.h"
#include "core/portable_math.h"
#include "pipeline/render.h"
#include "truth/reference_field.h"
#include "truth/reference_light.h"
#include "truth/reference_matter.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

namespace squint {
namespace reference {
namespace {

constexpr double kSpent = 1e-12;    // below this transparency nothing behind is seen
constexpr double kSpentDepth = 40;  // exp(-40) = 4e-18
constexpr int kMostHalvings = 48;   // pins a jump of the light's direction down to a rounding

// Gauss-Legendre with 3 points and Kronrod's extension to 7, on [-1, 1].  Exact to degrees 5 and 11.
constexpr std::array<double, 7> kNode{
    -0.960491268708020283423507092629080, -0.774596669241483377035853079956480,
    -0.434243749346802558002071502844628, 0,
    0.434243749346802558002071502844628,  0.774596669241483377035853079956480,
    0.960491268708020283423507092629080};
constexpr std::array<double, 7> kKronrod{
    0.104656226026467265193823857192073, 0.268488089868333440728569280666710,
    0.401397414775962222905051818618432, 0.450916538658474142345110087045571,
    0.401397414775962222905051818618432, 0.268488089868333440728569280666710,
    0.104656226026467265193823857192073};
constexpr std::array<double, 7> kGauss{0, 5.0 / 9, 0, 8.0 / 9, 0, 5.0 / 9, 0};

/// exp(-x), x >= 0.  Most pieces are thin: up to 1/32 eight terms of the series suffice.
inline double attenuation(double x) {
    if (x > 0.03125) return portable::exp(-x);
    const double y = x * x;
    return (1 - x) + y * ((1.0 / 2 - x * (1.0 / 6)) +
                          y * ((1.0 / 24 - x * (1.0 / 120)) + y * (1.0 / 720 - x * (1.0 / 5040))));
}

/// A piece of a ray between two knots, q from 0 to 1.
struct Piece {
    Cubic rise;                     // the coordinate above the stretch's first entry
    std::array<double, 5> depth{};  // optical depth from the piece's front, a quartic
    double length = 0;              // world units
    const Stretch* stretch = nullptr;

    double depth_at(double q) const {
        return q * (depth[1] + q * (depth[2] + q * (depth[3] + q * depth[4])));
    }
    double extinction_at(double q) const {
        return stretch->extinction + stretch->extinction_slope * rise.at(q);
    }
    Vec3 color_at(double q) const { return stretch->color + stretch->color_slope * rise.at(q); }
};

Piece piece_of(const Cubic& coordinate, double from, double to, double length, const Stretch& stretch) {
    Piece piece;
    piece.rise = coordinate.stretched(from, to - from);
    piece.rise.c[0] -= stretch.first;
    piece.length = length * (to - from);
    piece.stretch = &stretch;
    constexpr std::array<double, 4> kIntegrated{1, 1.0 / 2, 1.0 / 3, 1.0 / 4};
    for (std::size_t k = 0; k < 4; ++k)
        piece.depth[k + 1] = piece.length * stretch.extinction_slope * piece.rise.c[k] * kIntegrated[k];
    piece.depth[1] += piece.length * stretch.extinction;
    return piece;
}

/// Integrates f over [from, to], part of a piece whose depth limits how far one sees into it: halves until
/// the two rules agree.
template <class Value, class F, class Size>
Value integrate(const Piece& piece, const F& f, const Size& size, double from, double to, double allowed,
                int halvings = 0) {
    const double front = piece.depth_at(from);
    if (front > kSpentDepth) return Value(0);
    const double middle = (from + to) / 2, half = (to - from) / 2;
    if (piece.depth_at(to) - front <= 2 || halvings >= kMostHalvings) {
        Value kronrod(0), gauss(0);
        for (std::size_t i = 0; i < 7; ++i) {
            const Value value = f(middle + half * kNode[i]);
            kronrod += value * kKronrod[i], gauss += value * kGauss[i];
        }
        if (halvings >= kMostHalvings || size((kronrod - gauss) * half) <= allowed) return kronrod * half;
    }
    return integrate<Value>(piece, f, size, from, middle, allowed / 2, halvings + 1) +
           integrate<Value>(piece, f, size, middle, to, allowed / 2, halvings + 1);
}

/// The same where f has no corner in the piece, nor near it: four points of Gauss, exact to degree 7, which show
/// themselves whether they are enough.  Of a series a_k x^k on [-1, 1] whose terms fall by a ratio r they err by 0.0116
/// a_0 r^8; a_2 / a_0 and a_3 / a_0 of the cubic through them are about r^2 and r^3.  Either alone may vanish by chance.
template <class Value, class F, class Size>
Value integrate_smooth(const Piece& piece, const F& f, const Size& size, double allowed) {
    constexpr double kOuter = 0.861136311594052575, kInner = 0.339981043584856265;
    constexpr double kOuterWeight = 0.347854845137453857, kInnerWeight = 0.652145154862546143;
    constexpr double kApart = kOuter * kOuter - kInner * kInner;
    constexpr double kThick = 0.25;  // depth: more points at once do better
    constexpr double kMiddle = 0.5, kHalf = 0.5;
    if (piece.depth_at(1) > kThick) return integrate<Value>(piece, f, size, 0, 1, allowed);
    const Value first = f(kMiddle - kHalf * kOuter), second = f(kMiddle - kHalf * kInner),
                third = f(kMiddle + kHalf * kInner), fourth = f(kMiddle + kHalf * kOuter);
    const Value outer = first + fourth, inner = second + third;
    const double value = size(inner) / 2, square = size(outer - inner) / (2 * kApart),
                 cube =
                     size((fourth - first) * (1 / kOuter) - (third - second) * (1 / kInner)) / (2 * kApart);
    const double square_2 = square * square;
    // Of value (square / value)^4 + value (cube / value)^3, without a division: 400 times what such a series errs by.
    const double error = 5 * kHalf * (square_2 * square_2 + cube * cube * cube * value);
    if (error <= allowed * value * value * value)
        return (outer * kOuterWeight + inner * kInnerWeight) * kHalf;
    return integrate<Value>(piece, f, size, 0, 1, allowed);
}

double largest(const Vec3& v) {
    return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

/// The light of an unlit piece that reaches its front.  By parts, with T = exp(-depth):
///     integral of c tau T = c(0) (1 - T(1)) + c' integral of s' (T - T(1)):  one integral for three colours.
Vec3 emission(const Piece& piece, double clear, double allowed) {
    const Stretch& s = *piece.stretch;
    Vec3 light = piece.color_at(0) * (1 - clear);
    const double slope = largest(s.color_slope);
    if (s.one_color || slope == 0) return light;
    const double integral = integrate_smooth<double>(
        piece, [&](double q) { return piece.rise.slope(q) * (attenuation(piece.depth_at(q)) - clear); },
        [](double x) { return std::abs(x); }, allowed / slope);
    return light + s.color_slope * integral;
}

/// The same where light falls: c tau T, with the colour c that the lights make.
template <class Reflect>
Vec3 lit_emission(const Piece& piece, const Reflect& reflect, bool smooth, double allowed) {
    const auto light_at = [&](double q) {
        const Reflection light = reflect(q);
        return light.of(piece.color_at(q)) *
               (piece.extinction_at(q) * piece.length * attenuation(piece.depth_at(q)));
    };
    return smooth ? integrate_smooth<Vec3>(piece, light_at, largest, allowed)
                  : integrate<Vec3>(piece, light_at, largest, 0, 1, allowed);
}

/// Where a polynomial that is monotone on [low, high] passes `target`: Halley's method from a guess, between
/// bounds that close in.  At a turning point its step is zero far from any root, so the value decides.
double crossing(const Cubic& p, double target, double low, double high, double guess, bool upwards) {
    double r = guess > low && guess < high ? guess : low;
    for (int i = 0; i < 100 && high - low > 1e-16; ++i) {
        const double value = p.at(r) - target, slope = p.slope(r), curve = p.c[2] + 3 * p.c[3] * r;
        if (std::abs(value) <= kTouch / 10) break;
        ((value < 0) == upwards ? low : high) = r;
        const double next = r - value * slope / (slope * slope - value * curve);
        if (!(next > low && next < high)) {
            r = (low + high) / 2;
            continue;
        }
        // A step of d leaves d^3 ((curve / slope)^2 + |c_3 / slope|) at most.
        const double d = std::abs(next - r);
        r = next;
        if (d * d * d * (curve * curve + std::abs(p.c[3] * slope)) <= 1e-17 * slope * slope) break;
    }
    return r;
}

/// The colour and transparency gathered along one ray.
class RayIntegral {
  public:
    RayIntegral(const Plan& plan, const Matter& matter, const RayLight* light, double allowed_per_length)
        : plan_(plan), matter_(matter), light_(light), allowed_per_length_(allowed_per_length) {}

    /// Adds a cell; returns false where the ray ends in it.
    bool add(const Passage& passage, const Corners& corners);
    std::array<double, 4> pixel() const { return {color_.x, color_.y, color_.z, 1 - clear_}; }

  private:
    bool add_field(const Passage& passage, const Cubic& scalar);
    bool add_monotone(double from, double to);
    void add_piece(double from, double to, const Stretch& stretch);
    void add_part(double from, double to, const Stretch& stretch);
    void find_corners();
    void end_at(double r, double coordinate);
    Reflection reflection_at(double r) const;

    const Plan& plan_;
    const Matter& matter_;
    const RayLight* light_;
    double allowed_per_length_;
    Vec3 color_{0, 0, 0};
    double clear_ = 1;
    // The current cell.
    Cubic coordinate_;
    std::array<Cubic, 3> gradient_, mean_gradient_;  // the latter where normals are exaggerated
    SplineGradient spline_;                          // in place of the former where the rule is cubic_spline
    bool smooth_ = true;                             // the light on it, but at its corners
    std::vector<double> corner_{};                   // where it has some, ascending
    double length_ = 0;
};

Reflection RayIntegral::reflection_at(double r) const {
    const auto at = [&](const std::array<Cubic, 3>& g) { return Vec3(g[0].at(r), g[1].at(r), g[2].at(r)); };
    const ShadingSettings& s = plan_.scene.shading;
    return (*light_)(s.gradient == GradientRule::cubic_spline ? spline_.at(r) : at(gradient_),
                     at(mean_gradient_));
}

/// Adds an opaque surface: nothing behind it is seen.
void RayIntegral::end_at(double r, double coordinate) {
    Vec3 color = matter_.color_at(coordinate);
    if (light_) {
        const Reflection light = reflection_at(r);
        color = light.of(color);
    }
    color_ += color * clear_;
    clear_ = 0;
}

/// Where a light is at the limit of what it lights: between two of these places its light is smooth.
void RayIntegral::find_corners() {
    corner_.clear();
    smooth_ = light_->has_corners_at_its_limits();
    if (!smooth_) return;
    for (const Vec3& limit : light_->limits()) {
        Cubic facing;
        for (std::size_t k = 0; k < 4; ++k)
            facing.c[k] =
                gradient_[0].c[k] * limit.x + gradient_[1].c[k] * limit.y + gradient_[2].c[k] * limit.z;
        const auto& c = facing.c;
        if (std::abs(c[0]) > std::abs(c[1]) + std::abs(c[2]) + std::abs(c[3])) continue;  // keeps its sign
        const Turns turns = turns_of(facing);
        double from = 0;
        for (int i = 0; i <= turns.count; ++i) {
            const double to = i < turns.count ? turns.at[static_cast<std::size_t>(i)] : 1;
            const double first = facing.at(from), last = facing.at(to);
            if (first * last < 0) corner_.push_back(crossing(facing, 0, from, to, from, last > first));
            from = to;
        }
    }
    std::sort(corner_.begin(), corner_.end());
}

void RayIntegral::add_piece(double from, double to, const Stretch& stretch) {
    for (const double corner : corner_)
        if (corner > from && corner < to) add_part(from, corner, stretch), from = corner;
    add_part(from, to, stretch);
}

void RayIntegral::add_part(double from, double to, const Stretch& stretch) {
    if (stretch.clear || !(to > from)) return;
    const Piece piece = piece_of(coordinate_, from, to, length_, stretch);
    // A piece's tolerance is at least a rounding.
    const double allowed = std::max(allowed_per_length_ * piece.length / clear_, 1e-15);
    const double through = attenuation(std::max(piece.depth_at(1), 0.0));
    const Vec3 light =
        light_ ? lit_emission(
                     piece, [&](double q) { return reflection_at(from + q * (to - from)); }, smooth_, allowed)
               : emission(piece, through, allowed);
    color_ += light * clear_;
    clear_ *= through;
}

/// From knot to knot, over a part of the cell where the field only rises or only falls.
bool RayIntegral::add_monotone(double from, double to) {
    const double first = coordinate_.at(from), last = coordinate_.at(to);
    const bool upwards = last > first;
    int index = matter_.stretch_at(first, upwards);
    double before = from, step = 0;  // the part before, and how much it was longer than the one before it
    for (double here = from;;) {
        const Stretch& stretch = matter_.stretch(index);
        const int knot = upwards ? stretch.last : stretch.first;
        const double left = upwards ? last - knot : knot - last;  // beyond the knot
        // Knots mostly stand one entry apart, and parts of the way change from one to the next by as much again.
        const double part = here - before, guess = here + part + step;
        const double next = left > 0 ? crossing(coordinate_, knot, here, to, guess, upwards) : to;
        add_piece(here, next, stretch);
        if (clear_ < kSpent) return false;
        if (left < -kTouch) return true;
        if (matter_.opaque_entry(knot)) {
            end_at(next, knot);
            return false;
        }
        index += upwards ? 1 : -1;
        if (left <= kTouch || index < 0 || index >= matter_.stretches()) return true;
        if (before > from) step = (next - here) - part;
        before = here, here = next;
    }
}

bool RayIntegral::add(const Passage& passage, const Corners& corners) {
    const double per_entry = plan_.entries.scalars_per_entry;
    const auto [least, greatest] = std::minmax_element(corners.begin(), corners.end());
    if (!matter_.visible(*least / per_entry, *greatest / per_entry)) return true;
    if (plan_.scene.sampling.interpolation != InterpolationRule::nearest)
        return add_field(passage, along(corners, passage));
    const NearestParts parts = nearest_along(corners, passage);
    for (int i = 0; i < parts.count; ++i) {
        const NearestPart& part = parts.part[static_cast<std::size_t>(i)];
        if (!add_field(part.passage, {{part.scalar}})) return false;
    }
    return true;
}

/// A stretch of the ray along which the field is a cubic.
bool RayIntegral::add_field(const Passage& passage, const Cubic& scalar) {
    coordinate_ = scalar;
    for (double& c : coordinate_.c) c /= plan_.entries.scalars_per_entry;
    length_ = passage.length;
    if (light_) {
        const ShadingSettings& s = plan_.scene.shading;
        if (s.gradient == GradientRule::cubic_spline)
            spline_ = SplineGradient(*plan_.volume, passage);
        else
            gradient_ = gradient_along(*plan_.volume, s.gradient, passage);
        if (s.exaggeration > 0) mean_gradient_ = mean_gradient_along(*plan_.volume, passage);
        find_corners();
    }
    if (matter_.opaque_at(coordinate_.at(0))) {
        end_at(0, coordinate_.at(0));
        return false;
    }
    const Turns turns = turns_of(coordinate_);
    double from = 0;
    for (int i = 0; i <= turns.count; ++i) {
        const double to = i < turns.count ? turns.at[static_cast<std::size_t>(i)] : 1;
        if (!add_monotone(from, to)) return false;
        from = to;
    }
    return true;
}

/// The least, greatest or mean coordinate of the field along a ray.
double projected(const Plan& plan, CellWalk& walk, double chord) {
    const CompositingMode mode = plan.scene.compositing.mode;
    const double sign = mode == CompositingMode::minip ? -1 : 1;
    double greatest = -INFINITY, sum = 0;
    const auto add = [&](const Cubic& field, double length) {
        sum += length * (field.c[0] + field.c[1] / 2 + field.c[2] / 3 + field.c[3] / 4);
        greatest = std::max({greatest, sign * field.at(0), sign * field.at(1)});
        const Turns turns = turns_of(field);
        for (int i = 0; i < turns.count; ++i)
            greatest = std::max(greatest, sign * field.at(turns.at[static_cast<std::size_t>(i)]));
    };
    for (Passage passage; walk.next(passage);) {
        const Corners corners = corners_of(*plan.volume, passage.cell);
        if (plan.scene.sampling.interpolation != InterpolationRule::nearest) {
            add(along(corners, passage), passage.length);
            continue;
        }
        const NearestParts parts = nearest_along(corners, passage);
        for (int i = 0; i < parts.count; ++i) {
            const NearestPart& part = parts.part[static_cast<std::size_t>(i)];
            add({{part.scalar}}, part.passage.length);
        }
    }
    const double scalar = mode == CompositingMode::average ? sum / chord : sign * greatest;
    return std::clamp(scalar / plan.entries.scalars_per_entry, 0.0, plan.entries.size() - 1.0);
}

/// A plan, prepared for integration.
class Reference {
  public:
    Reference(const Plan& plan, double tolerance, bool many_rays);
    std::array<double, 4> pixel(int column, int row) const;

  private:
    Vec3 corner(bool high) const;
    const Plan& plan_;
    double tolerance_;
    Vec3 low_, high_;
    Matter matter_;
    std::unique_ptr<Blocks> blocks_;
};

/// The intersection of the volume's box and the scene's clip box, where both lie along the same axes.
Vec3 Reference::corner(bool high) const {
    const Volume& v = *plan_.volume;
    if (v.turned()) return high ? v.box_high() : v.box_low();
    const auto& clip = high ? plan_.scene.clip.high : plan_.scene.clip.low;
    Vec3 corner = high ? v.box_high() : v.box_low();
    for (int a = 0; clip && a < 3; ++a)
        corner[a] = high ? std::min(corner[a], (*clip)[a]) : std::max(corner[a], (*clip)[a]);
    return corner;
}

// A quarter of the tolerance goes to knots left out, along the longest ray, and half to quadrature.
Reference::Reference(const Plan& plan, double tolerance, bool many_rays)
    : plan_(plan),
      tolerance_(tolerance),
      low_(corner(false)),
      high_(corner(true)),
      matter_(plan.entries,
              tolerance / 8 / std::max((high_ - low_).length(), plan.volume->smallest_spacing()),
              tolerance / 8) {
    const bool skips = plan.scene.compositing.mode == CompositingMode::over;
    const double per_entry = plan.entries.scalars_per_entry;
    if (skips && many_rays)
        blocks_ = std::make_unique<Blocks>(*plan.volume, [&](double least, double greatest) {
            return matter_.visible(least / per_entry, greatest / per_entry);
        });
}

std::array<double, 4> Reference::pixel(int column, int row) const {
    const Ray ray = plan_.camera.ray(column, row);
    Interval inside = intersect(ray, low_, high_);
    if (plan_.clip) inside = common(inside, intersect(ray, *plan_.clip));
    if (inside.empty()) return {};
    const double chord = inside.last - inside.first;
    CellWalk walk(*plan_.volume, ray, inside, blocks_.get());
    if (plan_.scene.compositing.mode != CompositingMode::over) {
        const double at = projected(plan_, walk, chord);
        const double depth = matter_.extinction_at(at) * plan_.entries.unit_distance;
        const double alpha = matter_.opaque_at(at) ? 1 : -portable::expm1(-depth);
        const Vec3 color = matter_.color_at(at) * alpha;
        return {color.x, color.y, color.z, alpha};
    }
    const RayLight light(plan_.scene, *plan_.volume, plan_.camera, ray.direction);
    RayIntegral integral(plan_, matter_, plan_.lit ? &light : nullptr, tolerance_ / 2 / chord);
    for (Passage passage; walk.next(passage);)
        if (!integral.add(passage, corners_of(*plan_.volume, passage.cell))) break;
    return integral.pixel();
}

}  // namespace
}  // namespace reference

std::array<double, 4> reference_pixel(const Plan& plan, int column, int row, double tolerance) {
    return reference::Reference(plan, tolerance, false).pixel(column, row);
}

Image render_reference(const Plan& plan, const ReferenceOptions& options) {
    Image image;
    image.width = plan.camera.width, image.height = plan.camera.height;
    for (const char* name : {"R", "G", "B", "A"}) image.add_float(name);
    const reference::Reference reference(plan, options.tolerance, true);

    constexpr int kTile = 16;
    const int across = (image.width + kTile - 1) / kTile,
              tiles = across * ((image.height + kTile - 1) / kTile);
    std::atomic<int> done{0};
    std::atomic<bool> stopped{false};
    const auto render_tile = [&](int tile) {
        const int left = tile % across * kTile, top = tile / across * kTile;
        for (int row = top; row < std::min(top + kTile, image.height); ++row)
            for (int column = left; column < std::min(left + kTile, image.width); ++column) {
                const std::array<double, 4> pixel = reference.pixel(column, row);
                const std::size_t at = static_cast<std::size_t>(row) * static_cast<std::size_t>(image.width) +
                                       static_cast<std::size_t>(column);
                for (std::size_t c = 0; c < 4; ++c)
                    image.channels[c].values[at] = static_cast<float>(pixel[c]);
            }
    };
    on_threads(options.threads, [&] {
        in_parallel(tiles, [&](int tile) {
            if (options.cancelled && *options.cancelled) stopped = true;
            if (stopped) return;
            render_tile(tile);
            if (options.progress) options.progress(static_cast<double>(++done) / tiles);
        });
    });
    if (stopped) throw Cancelled{};
    return image;
}

}  // namespace squint
