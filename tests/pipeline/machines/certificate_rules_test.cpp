// Rules of the certificate that no picture shows alone: each holds for whatever the words may stand for,
// and no longer does when it is halved.
#include "core/portable_math.h"
#include "pipeline/classification/tables/legendre.h"
#include "pipeline/classification/tables/power_series.h"
#include "pipeline/machines/certificate/methods.h"
#include "pipeline/machines/certificate/stages.h"
#include "pipeline/record.h"
#include "pipeline/render.h"
#include "tests/pipeline/machines/draw.h"
#include "tests/plan_of.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

namespace squint {
namespace {

using Exact = Real<double>;

Plan plan_with(const std::vector<std::string>& more) {
    std::vector<std::string> settings{"volume.procedural=ramp", "volume.dims=9", "volume.bits=8",
                                      "classification.method=pips", "lights=[{headlight=true}]"};
    settings.insert(settings.end(), more.begin(), more.end());
    const Scene scene = scene_with(built_in_scene(), settings);
    return test::plan_of(scene);
}
Bounded off_by(std::int64_t v, double error) {
    return with_error(v, Shares::one(0, error));
}

// How far a rule's numbers are from what they stand for, over the rule's bound: at most one, and more than a half.
struct Ratio {
    double most = 0;
    void take(double off, double bound) {
        if (!(off <= bound * (1 + 1e-9) + 1e-6)) most = std::max(most, 2.0);
        if (bound > 1e-3) most = std::max(most, off / bound);
    }
    void check(const char* rule) const {
        std::printf("%s %g\n", rule, most);
        EXPECT_LE(most, 1 + 1e-6) << rule;
        EXPECT_GT(most, 0.5) << "the rule for " << rule << " could be halved, and nothing here would tell";
    }
};

std::string drawn_points(Draw& draw, bool opaque) {
    std::string points;
    double at = 0;
    for (std::int64_t i = draw.between(2, 6); i >= 0; --i) {
        const double alpha =
            opaque && draw.once_in(4) ? 1 : draw.one_of({0.0, draw.real(0, 0.9), draw.real(0, 0.1)});
        points += fmt::format("{}[{},{},{},{},{}]", points.empty() ? "" : ",", at, draw.real(0, 1),
                              draw.real(0, 1), draw.real(0, 1), alpha);
        at = std::min(at + std::floor(draw.real(1, 90)), 255.0);
        if (at >= 255) break;
    }
    return "transfer_function.points=[" + points + "]";
}

class PlacesOfLight : public ::testing::TestWithParam<const char*> {};
TEST_P(PlacesOfLight, HoldForAllThatASlabMayBeAndHalvedDoNot) {
    const std::string rule = GetParam();
    Ratio by_ends, by_length, lean_by_ends, lean_by_length;
    for (unsigned seed = 1; seed <= 60; ++seed) {
        Draw draw(seed);
        const Plan plan = plan_with(
            {"shading.inside=" + rule, drawn_points(draw, draw.once_in(2)), "precision.preset=wide"});
        const Plan real = real_plan(plan);
        const Function function(plan);
        const PrefixLookup& words = std::get<PowerSeriesOfOrder1>(plan.method).prefix;
        const PrefixLookup& exact = std::get<PowerSeriesOfOrder1>(real.method).prefix;
        const BoundedPrefix prefix{words, exact, real.inside, function};
        const double unit = std::ldexp(1.0, words.entries.input_fraction),
                     full = std::ldexp(1.0, words.entries.length_fraction);
        const auto highest = static_cast<double>(function.last()) * unit;
        for (int slab = 0; slab < 40; ++slab) {
            const bool only_length = draw.once_in(2);
            const double span = draw.one_of({2.0, 30.0, 200.0});
            const double at = draw.real(0, 255);
            const auto input = [&](double entry) {
                return static_cast<std::int64_t>(std::clamp(entry * unit, 0.0, highest));
            };
            const double off = only_length ? 0 : draw.one_of({0.001, 0.1, 0.5}) * span / 4 * unit,
                         length_off = only_length ? draw.real(0, 0.3) * full : 0;
            const Bounded front = off_by(input(at), off),
                          back = off_by(input(at + draw.real(-span, span)), off),
                          length = off_by(static_cast<std::int64_t>(draw.real(0.3, 0.7) * full), length_off);
            const auto bounded = places_of_light(plan.inside, prefix, front, back, length);
            const Bounded lean = lean_between(plan.inside, prefix, front, back, length);
            for (int corner = 0; corner < 8; ++corner) {
                const auto moved = [&](const Bounded& x, int bit, double most) {
                    const double to = draw.once_in(4) ? draw.real(-1, 1) : corner >> bit & 1 ? 1 : -1;
                    return Exact{std::clamp(in_double(x.v) + to * x.most(), 0.0, most)};
                };
                const Exact f = moved(front, 0, highest), b = moved(back, 1, highest),
                            l = moved(length, 2, full);
                const auto places = HWY_NAMESPACE::places_of_light(real.inside, exact, f, b, l);
                Ratio& ratio = only_length ? by_length : by_ends;
                ratio.take(std::abs(places.near.v - in_double(bounded.near.v)), bounded.near.most());
                ratio.take(std::abs(places.far.v - in_double(bounded.far.v)), bounded.far.most());
                ratio.take(std::abs(places.share.v - in_double(bounded.share.v)), bounded.share.most());
                (only_length ? lean_by_length : lean_by_ends)
                    .take(std::abs(HWY_NAMESPACE::lean_between(real.inside, exact, f, b, l).v -
                                   in_double(lean.v)),
                          lean.most());
            }
        }
    }
    by_ends.check("ends of places");
    by_length.check("length of places");
    lean_by_ends.check("ends of leans");
    lean_by_length.check("length of leans");
}
INSTANTIATE_TEST_SUITE_P(CertificateRules, PlacesOfLight, ::testing::Values("two_point", "centroid"));

TEST(CertificateRules, OfPiecesHoldAndHalvedDoNot) {
    const Plan plan = plan_with({"lights=[]"});
    const InsideStage& s = plan.inside;
    const auto one = static_cast<double>(s.one_alpha);
    const double one_color = std::ldexp(1.0, plan.specs[s.color_wire].format.fraction_bits);
    std::array<Ratio, 2> of_color;  // by an error of opacities, of colours
    Ratio of_opacity;
    for (unsigned seed = 1; seed <= 4000; ++seed) {
        Draw draw(seed);
        const bool colors_err = draw.once_in(2);
        const auto count = static_cast<std::size_t>(draw.between(1, 4));
        std::vector<Slab<Bounded>> pieces(count);
        auto sum = HWY_NAMESPACE::no_piece<Bounded>(s);
        for (Slab<Bounded>& p : pieces) {
            const double alpha = draw.one_of({0.2, 1.0, draw.real(0.05, 1)}),
                         off = colors_err ? 0 : std::min({draw.real(0, 0.05), alpha, 1 - alpha});
            p.alpha = off_by(static_cast<std::int64_t>(alpha * one), off * one);
            const double color = draw.one_of({0.1, 0.9, draw.real(0.1, 0.9)});
            for (Bounded& c : p.color)
                c = off_by(static_cast<std::int64_t>(color * one_color), colors_err ? 0.05 * one_color : 0);
            add_piece(s, sum, p.color, p.alpha);
        }
        const std::array<Bounded, 3> color = color_of_pieces(s, sum);
        const Bounded opacity = HWY_NAMESPACE::opacity_of_pieces(s, sum);
        for (int corner = 0; corner < 1 << count; ++corner) {
            double clear = 1, light = 0;
            for (std::size_t i = 0; i < count; ++i) {
                const double to = corner >> i & 1 ? 1 : -1;
                const double alpha = (in_double(pieces[i].alpha.v) + to * pieces[i].alpha.most()) / one,
                             c = (in_double(pieces[i].color[0].v) + to * pieces[i].color[0].most()) /
                                 one_color;
                light += clear * alpha * c, clear *= 1 - alpha;
            }
            of_color[colors_err].take(std::abs(light / (1 - clear) * one_color - in_double(color[0].v)),
                                      color[0].most());
            of_opacity.take(std::abs((1 - clear) * one - in_double(opacity.v)), opacity.most());
        }
    }
    of_color[0].check("colour of pieces, by opacities");
    of_color[1].check("colour of pieces, by colours");
    of_opacity.check("opacity of pieces");
}

// Whether a cell that a point may lie in holds a wall: said to be sure only where no displacement changes it.
TEST(CertificateRules, OfSecondLooksHoldAndHalvedDoNot) {
    const Plan plan = plan_with(
        {"lights=[]", "transfer_function.points=[[0,1,1,1,0],[100,1,1,1,0],[101,1,1,1,1],[255,1,1,1,1]]"});
    ASSERT_TRUE(plan.walls.looks_twice);
    const BoundedVolume voxels{*plan.volume, plan.interpolation.weight_bits};
    const HWY_NAMESPACE::FromVolume volume{*plan.volume};
    const double whole = std::ldexp(1.0, voxels.weight_bits);
    int wrong = 0, wrong_of_half = 0;
    for (unsigned seed = 1; seed <= 3000; ++seed) {
        Draw draw(seed);
        CellPosition<Bounded> position, half;
        std::array<std::int64_t, 3> moved{};
        for (std::size_t a = 0; a < 3; ++a) {
            const std::int64_t cell = draw.between(0, 7);
            const double place = draw.real(0, 1), off = draw.real(0, 0.4),
                         there = place + off * draw.one_of({-1.0, 1.0});
            position.cell[a] = half.cell[a] = constant<Bounded>(cell);
            position.weight[a] = off_by(static_cast<std::int64_t>(place * whole), off * whole);
            half.weight[a] = off_by(static_cast<std::int64_t>(place * whole), off * whole / 2);
            moved[a] = std::clamp<std::int64_t>(cell + static_cast<std::int64_t>(std::floor(there)), 0, 7);
        }
        const std::int64_t is = volume.nears_wall(plan.walls, moved);
        const Bounded said = nears_wall(voxels, plan.walls, position),
                      of_half = nears_wall(voxels, plan.walls, half);
        wrong += said.exact && said.v != is, wrong_of_half += of_half.exact && of_half.v != is;
    }
    EXPECT_EQ(wrong, 0);
    EXPECT_GT(wrong_of_half, 0);
}

// How many pieces adaptive light has: said to be sure only where no error of the gradients changes it.
TEST(CertificateRules, OfAdaptivePiecesHoldAndHalvedDoNot) {
    int wrong = 0, wrong_of_half = 0;
    for (unsigned seed = 1; seed <= 4000; ++seed) {
        Draw draw(seed);
        std::array<Bounded, 3> front, back, front_half, back_half;
        std::array<Exact, 3> front_there, back_there;
        const Vec3 f = draw.vector(-1, 1), b = draw.vector(-1, 1);
        const double off = draw.real(0, 0.2);
        for (int axis = 0; axis < 3; ++axis) {
            const auto a = static_cast<std::size_t>(axis);
            const auto of = [&](double v, Bounded& whole, Bounded& half, Exact& there) {
                constexpr double kUnit = 1 << 12;
                whole = off_by(static_cast<std::int64_t>(v * kUnit), off * kUnit);
                half = off_by(whole.v == 0 ? 0 : static_cast<std::int64_t>(v * kUnit), off * kUnit / 2);
                there.v = in_double(whole.v) + draw.one_of({-1.0, 1.0}) * off * kUnit;
            };
            of(f[axis], front[a], front_half[a], front_there[a]),
                of(b[axis], back[a], back_half[a], back_there[a]);
        }
        const double is = HWY_NAMESPACE::cuts_between(front_there, back_there).v;
        const Bounded said = cuts_between(front, back), of_half = cuts_between(front_half, back_half);
        wrong += std::abs(is - in_double(said.v)) > said.most() + 1e-9;
        wrong_of_half += std::abs(is - in_double(of_half.v)) > of_half.most() + 1e-9;
    }
    EXPECT_EQ(wrong, 0);
    EXPECT_GT(wrong_of_half, 0);
}

// A difference of voxels where its place may be another: a quadratic field, and noise.  `near(voxels, cell)`: what it is of.
template <class Near>
void check_differences(const char* rule, const GradientStage& s, const GradientStage& real,
                       const Near& near) {
    const ProceduralField square{
        "square", "", 8, 16, [](const Vec3& p) { return p.x * p.x; }, [](const Vec3&) { return Vec3(); }};
    const double whole = std::ldexp(1.0, s.weight_bits);
    Ratio ratio;
    for (const ProceduralField* field : {&square, &noise_field()}) {
        const Volume volume = make_procedural(*field, {9, 9, 9}, 8);
        const BoundedVolume bounded{volume, s.weight_bits};
        const HWY_NAMESPACE::FromVolume exact{volume};
        for (unsigned seed = 1; seed <= 3000; ++seed) {
            Draw draw(seed);
            std::array<Bounded, 3> cell, weight;
            std::array<std::int64_t, 3> moved_cell{};
            std::array<Exact, 3> moved;
            for (std::size_t a = 0; a < 3; ++a) {
                const std::int64_t at = draw.between(0, 7);
                const double place = draw.one_of({0.0, draw.real(0, 1)}), off = draw.one_of({0.001, 0.05});
                cell[a] = constant<Bounded>(at);
                weight[a] = off_by(static_cast<std::int64_t>(place * whole), off * whole);
                const double there = std::clamp(
                    static_cast<double>(at) + in_double(weight[a].v) / whole + off * draw.one_of({-1.0, 1.0}),
                    0.0, 8.0);
                moved_cell[a] = std::min<std::int64_t>(static_cast<std::int64_t>(there), 7);
                moved[a].v = (there - static_cast<double>(moved_cell[a])) * whole;
            }
            for (int axis = 0; axis < 3; ++axis) {
                const Bounded slope = voxel_difference(s, near(bounded, cell), weight, axis);
                std::array<Exact, 3> place;
                for (std::size_t a = 0; a < 3; ++a) place[a].v = static_cast<double>(moved_cell[a]);
                const double is = HWY_NAMESPACE::voxel_difference(real, near(exact, place), moved, axis).v;
                ratio.take(std::abs(is - in_double(slope.v)), slope.most());
            }
        }
    }
    ratio.check(rule);
}
TEST(CertificateRules, OfSplinesHoldAndHalvedDoNot) {
    const Plan plan = plan_with({"shading.gradient=cubic_spline", "precision.preset=wide"}),
               real = real_plan(plan);
    check_differences("splines", plan.gradient, real.gradient,
                      [](const auto& voxels, const auto& cell) { return voxels.neighbourhood(cell); });
}
TEST(CertificateRules, OfSumsOfVoxelsHoldAndHalvedDoNot) {
    const Plan plan = plan_with({"shading.exaggeration=1", "precision.preset=wide"}), real = real_plan(plan);
    check_differences("sums", plan.box_gradient, real.box_gradient,
                      [](const auto& voxels, const auto& cell) { return voxels.box_sums(cell); });
}
TEST(CertificateRules, OfLengthsOfGradientsHoldAndHalvedDoNot) {
    Ratio ratio;
    for (unsigned seed = 1; seed <= 3000; ++seed) {
        Draw draw(seed);
        std::array<Bounded, 3> bounded;
        std::array<Exact, 3> moved;
        const double off = draw.real(0, 0.3) * (draw.once_in(2) ? 1 : -1);
        const Vec3 g = draw.vector(-1, 1) * 4096;
        for (int axis = 0; axis < 3; ++axis) {
            const auto a = static_cast<std::size_t>(axis);
            bounded[a] = off_by(static_cast<std::int64_t>(g[axis]), std::abs(off * g[axis]));
            moved[a].v = in_double(bounded[a].v) + off * g[axis];
        }
        const Bounded length = gradient_length(bounded);
        ratio.take(std::abs(HWY_NAMESPACE::gradient_length(moved).v - in_double(length.v)), length.most());
    }
    ratio.check("lengths of gradients");
}

// nlpi: the arc between two normals.
TEST(CertificateRules, OfArcsHoldAndHalvedDoNot) {
    const Plan plan = plan_with({"shading.inside=nlpi", "precision.preset=wide"}), real = real_plan(plan);
    const double one = std::ldexp(1.0, plan.specs[Wire::normal].format.fraction_bits);
    Ratio ratio;
    for (unsigned seed = 1; seed <= 3000; ++seed) {
        Draw draw(seed);
        std::array<Bounded, 3> front, back;
        const double off = draw.real(0, 0.1) * one;
        for (std::array<Bounded, 3>* n : {&front, &back}) {
            const Vec3 drawn = draw.vector(-1, 1),
                       v = drawn / std::sqrt(drawn.x * drawn.x + drawn.y * drawn.y + drawn.z * drawn.z);
            for (int axis = 0; axis < 3; ++axis)
                (*n)[static_cast<std::size_t>(axis)] = off_by(static_cast<std::int64_t>(v[axis] * one), off);
        }
        const Bounded bounded = arc_between(plan.shading, front, back);
        for (const double to : {-1.0, 1.0}) {
            std::array<Exact, 3> f, b;
            for (std::size_t a = 0; a < 3; ++a) {
                const auto sign = [](const Bounded& x) { return x.v < 0 ? -1.0 : 1.0; };
                f[a].v = in_double(front[a].v) + to * sign(back[a]) * off;
                b[a].v = in_double(back[a].v) + to * sign(front[a]) * off;
            }
            ratio.take(std::abs(HWY_NAMESPACE::arc_between(real.shading, f, b).v - in_double(bounded.v)),
                       bounded.most());
        }
    }
    ratio.check("arcs");
}

// Of PIPS(n) and LEG(n) no picture meets the constants: they are the kernels' own greatest values.
double kernel_at(int order, bool legendre, double x, double y) {
    const auto integral = [](const auto& f) {  // over [0, 1], by Simpson's rule
        constexpr int kSteps = 400;
        double sum = f(0.0) + f(1.0);
        for (int i = 1; i < kSteps; ++i) sum += f(i / double{kSteps}) * (i % 2 ? 4 : 2);
        return sum / 3 / kSteps;
    };
    if (!legendre) {
        const auto p = [&](double t) {
            double term = 1, sum = 1;
            for (int k = 1; k < order; ++k) term *= -t / k, sum += term;
            return sum;
        };
        return p(x * y) / integral([&](double u) { return p(x * u); });
    }
    const auto polynomial = [](int j, double u) {
        const double z = 2 * u - 1;
        return j == 0 ? 1 : j == 1 ? z : j == 2 ? (3 * z * z - 1) / 2 : (5 * z * z * z - 3 * z) / 2;
    };
    const auto decay = [&](double u) { return portable::exp(-x * u); };
    double sum = 0;
    for (int j = 0; j < order; ++j)
        sum +=
            (2 * j + 1) * polynomial(j, y) * integral([&](double u) { return polynomial(j, u) * decay(u); });
    return sum / integral(decay);
}
TEST(CertificateRules, OfSeriesAreTheirKernelsGreatestValuesAndHalvedAreNot) {
    for (const bool legendre : {false, true})
        for (int order = 2; order <= (legendre ? 4 : 5); ++order) {
            const double up_to =
                legendre ? preintegration::legendre_split_depth(order) : preintegration::trusted_depth(order);
            double most = 0, slope = 0, by_depth = 0;
            constexpr int kSteps = 40;
            constexpr double kStep = 1e-4;
            for (int i = 0; i <= kSteps; ++i)
                for (int j = 0; j <= kSteps; ++j) {
                    const double x = up_to * i / kSteps, y = static_cast<double>(j) / kSteps;
                    const double here = kernel_at(order, legendre, x, y);
                    most = std::max(most, std::abs(here));
                    const double dy = y > 0.5 ? -kStep : kStep, dx = i > 0 ? -kStep : kStep;
                    slope = std::max(slope, std::abs(kernel_at(order, legendre, x, y + dy) - here) / kStep);
                    by_depth =
                        std::max(by_depth, std::abs(kernel_at(order, legendre, x + dx, y) - here) / kStep);
                }
            const SeriesKernel kernel = series_kernel(order, legendre);
            std::printf("%s(%d) up to %g: %g %g %g\n", legendre ? "LEG" : "PIPS", order, up_to, most, slope,
                        by_depth);
            for (const auto& [constant, greatest] :
                 {std::pair(kernel.most, most), std::pair(kernel.slope, slope),
                  std::pair(kernel.by_depth, by_depth)}) {
                EXPECT_GE(constant, greatest * (1 - 1e-3)) << order << legendre;
                EXPECT_LT(constant / 2, greatest) << order << legendre;
            }
        }
}

}  // namespace
}  // namespace squint
