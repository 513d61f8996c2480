// The tally against a count of its own: a word that knows no widths and counts what the stages do with it.
#include "studies/sweep/cost.h"

#include "pipeline/plan/any_slab-inl.h"
#include "pipeline/render.h"
#include "pipeline/stages/ray_setup-inl.h"
#include "scene/scene.h"
#include "tests/plan_of.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

namespace squint {
namespace {

struct Counts {
    std::int64_t products = 0, constant_products = 0, quotients = 0, roundings = 0, lookups = 0;
    bool operator==(const Counts&) const = default;
};
std::ostream& operator<<(std::ostream& out, const Counts& c) {
    return out << c.products << " products, " << c.constant_products << " by constants, " << c.quotients
               << " quotients, " << c.roundings << " roundings, " << c.lookups << " look-ups";
}
Counts counted;

/// An integer, constant or not.  `BothWays`: comparisons have no answer, and what varies has no value.
template <bool BothWays>
struct Counting {
    Int128 v = 0;
    bool is_constant = false;
};
template <bool B>
Counting<B> varying(Int128 v) {
    return {B ? 0 : v, false};
}
template <bool B>
Counting<B> result_of(Int128 v, bool is_constant) {
    return is_constant ? Counting<B>{v, true} : varying<B>(v);
}
template <bool B>
bool is_shift(const Counting<B>& x) {
    const Int128 size = squint::absolute(x.v);
    return x.is_constant && (size & (size - 1)) == 0;
}
template <bool B>
void count_product(const Counting<B>& a, const Counting<B>& b) {
    if (is_shift(a) || is_shift(b) || (a.is_constant && b.is_constant)) return;
    ++(a.is_constant || b.is_constant ? counted.constant_products : counted.products);
}
template <bool B>
Counting<B> make_word(WordTag<Counting<B>>, std::int64_t value) {
    return {value, true};
}
template <bool B>
Counting<B> operator+(Counting<B> a, Counting<B> b) {
    return result_of<B>(a.v + b.v, a.is_constant && b.is_constant);
}
template <bool B>
Counting<B> operator-(Counting<B> a, Counting<B> b) {
    return result_of<B>(a.v - b.v, a.is_constant && b.is_constant);
}
template <bool B>
Counting<B> operator*(Counting<B> a, Counting<B> b) {
    count_product(a, b);
    return result_of<B>(a.v * b.v, a.is_constant && b.is_constant);
}
template <bool B>
auto answer(bool yes) {
    if constexpr (B)
        return Perhaps{};
    else
        return yes;
}
template <bool B>
auto operator==(Counting<B> a, Counting<B> b) {
    return answer<B>(a.v == b.v);
}
template <bool B>
auto operator<(Counting<B> a, Counting<B> b) {
    return answer<B>(a.v < b.v);
}
template <bool B>
Counting<B> shift_left(Counting<B> x, int bits) {
    return result_of<B>(squint::shift_left(x.v, bits), x.is_constant);
}
template <bool B>
Counting<B> floor_shift(Counting<B> x, int bits) {
    return result_of<B>(x.v >> bits, x.is_constant);
}
template <bool B>
Counting<B> min(Counting<B> a, Counting<B> b) {
    return result_of<B>(std::min(a.v, b.v), a.is_constant && b.is_constant);
}
template <bool B>
Counting<B> max(Counting<B> a, Counting<B> b) {
    return result_of<B>(std::max(a.v, b.v), a.is_constant && b.is_constant);
}
template <bool B>
Counting<B> absolute(Counting<B> x) {
    return result_of<B>(squint::absolute(x.v), x.is_constant);
}
template <bool B, class C>
Counting<B> select(C condition, Counting<B> yes, Counting<B> no) {
    if constexpr (std::is_convertible_v<C, bool>)  // of bools & is an int
        return varying<B>(condition ? yes.v : no.v);
    else
        return varying<B>(0);
}
template <bool B>
Counting<B> gather(const Table& table, Counting<B> row, int column) {
    ++counted.lookups;
    return varying<B>(table.word(static_cast<std::int64_t>(row.v), column));
}
template <bool B>
std::array<Counting<B>, 4> gather_cell(const CellTable& table, Counting<B> row, Counting<B> column) {
    counted.lookups += 4;
    const auto cell = squint::gather_cell(table, row.v, column.v);
    return {varying<B>(cell[0]), varying<B>(cell[1]), varying<B>(cell[2]), varying<B>(cell[3])};
}
template <bool B>
Counting<B> blend(Counting<B> v0, Counting<B> v1, Counting<B> weight, int bits) {
    count_product(v1 - v0, weight);
    return varying<B>(squint::blend(v0.v, v1.v, weight.v, bits));
}
template <bool B>
Counting<B> affine(Counting<B> p, Counting<B> k, Counting<B> v, std::int64_t, std::int64_t) {
    count_product(k, v);
    return varying<B>(p.v + k.v * v.v);
}
template <bool B>
Counting<B> within(Counting<B> x, std::int64_t, std::int64_t) {
    return x;
}
template <bool B>
Counting<B> bit_length(Counting<B> x) {
    return varying<B>(squint::bit_length(x.v));
}
template <bool B>
Counting<B> shift_by(Counting<B> x, Counting<B> bits) {
    return varying<B>(B ? 0 : squint::shift_by(x.v, bits.v));
}
template <bool B>
Counting<B> vector_length(const std::array<Counting<B>, 3>& v, int guard) {
    counted.products += 3, ++counted.quotients;
    return varying<B>(squint::vector_length(std::array{v[0].v, v[1].v, v[2].v}, guard));
}
template <bool B>
Counting<B> quantise(Counting<B> x, const Rescale& to) {
    counted.roundings += !x.is_constant && to.shift > 0 && to.rounding != Rounding::trn;
    return result_of<B>(squint::quantise(x.v, to), x.is_constant);
}
template <bool B>
Counting<B> quotient(Counting<B> numerator, Counting<B> denominator, const Rescale& to) {
    counted.roundings += to.rounding != Rounding::trn;
    if (!is_shift(denominator)) ++(denominator.is_constant ? counted.constant_products : counted.quotients);
    return varying<B>(B ? 0 : squint::quotient(numerator.v, denominator.v, to));
}
using EveryPath = Counting<true>;
using OnePath = Counting<false>;
std::int64_t to_index(OnePath x) {
    return static_cast<std::int64_t>(x.v);
}
EveryPath any_word(WordTag<EveryPath>, const Range&, int) {
    return {};
}
Range range_of(const EveryPath&) {
    return {};
}

// What a run counts, part by part.
struct AllSlabs : Silent {
    std::array<Counts, kParts> counts{};
    int part = -1;
    void at(Part p) { close(), part = static_cast<int>(p); }
    void close() {
        if (part >= 0) {
            Counts& c = counts[static_cast<std::size_t>(part)];
            c.products += counted.products, c.constant_products += counted.constant_products;
            c.quotients += counted.quotients, c.roundings += counted.roundings, c.lookups += counted.lookups;
        }
        counted = {};
    }
};
// What a run of any slab counts, its last slab alone.
struct LastSlab : AllSlabs {
    void slab(const EveryPath&) { close(), counts = {}; }
};

Counts counts_of(const Bill& bill) {
    std::int64_t roundings = 0;
    for (const auto& [width, count] : bill.roundings) roundings += count;
    return {Bill::number(bill.multipliers), Bill::number(bill.constant_multipliers),
            Bill::number(bill.dividers), roundings, bill.lookups};
}

// A volume whose voxels vary.
struct VaryingVoxels {
    HWY_NAMESPACE::FromVolume voxels;
    template <class W>
    Cell<W> cell(const std::array<W, 3>& at) const {
        auto cell = voxels.cell(at);
        for (W& corner : cell.corner) corner.is_constant = false;
        return cell;
    }
    template <class W>
    HWY_NAMESPACE::Neighbourhood<W> neighbourhood(const std::array<W, 3>& at) const {
        auto near = voxels.neighbourhood(at);
        for (W& voxel : near.voxel) voxel.is_constant = false;
        return near;
    }
    template <class W>
    HWY_NAMESPACE::Neighbourhood<W> box_sums(const std::array<W, 3>& at) const {
        auto near = voxels.box_sums(at);
        for (W& sum : near.voxel) sum.is_constant = false;
        return near;
    }
    template <class W>
    W nears_wall(const WallStage& walls, const std::array<W, 3>& at) const {
        W near = voxels.nears_wall(walls, at);
        near.is_constant = false;
        return near;
    }
};

Plan plan_with(std::vector<std::string> settings) {
    settings.insert(settings.begin(), {"volume.dims=[16, 16, 16]", "classification.method=pc"});
    const Scene scene = scene_with(built_in_scene(), settings);
    return test::plan_of(scene);
}

const std::vector<std::vector<std::string>> kMethods{
    {"classification.method=pc"},
    {"classification.method=pi1d"},
    {"classification.method=pi1d_engel"},
    {"classification.method=pi2d", "classification.table_size=64"},
    {"classification.method=pi2d", "classification.table_size=64", "classification.lookup=nearest"},
    {"classification.method=pips"},
    {"classification.method=pips", "classification.order=2"},
    {"classification.method=pips", "classification.order=3"},
    {"classification.method=pips", "classification.order=5"},
    {"classification.method=leg", "classification.order=2"},
    {"classification.method=leg", "classification.order=4"}};
const std::vector<std::vector<std::string>> kVariants{
    {},
    {"shading.model=none"},
    {"shading.model=phong"},
    {"shading.model=phong", "camera.projection=perspective", "camera.fov_y=30"},
    {"shading.power=table", "shading.exponent=20", "shading.gradient=sobel"},
    {"shading.power=parabola", "shading.gradient=analytic", "volume.spacing=[1, 1, 2]"},
    {"shading.gradient=central_samples", "compositing.form=back_to_front"},
    {"shading.ks=0.3", "shading.two_sided=true", "compositing.form=alpha"},
    {"shading.exaggeration=1"},
    {"precision.preset=squeeze"},
    {"precision.preset=eight_bit"},
    {"sampling.interpolation=nearest", "precision.preset=wide"},
    {"compositing.mode=mip"},
    {"compositing.mode=average"}};

// Where slabs take different ways: lit or not, opaque, cut in pieces, in a projection or backwards.
const std::vector<std::vector<std::string>> kTakenVariants{
    {},
    {"shading.model=none"},
    {"shading.inside=adaptive", "sampling.step=2"},
    {"shading.exaggeration=1"},
    {"shading.gradient=central_samples", "compositing.form=back_to_front"},
    {"sampling.interpolation=nearest", "precision.preset=wide"},
    {"compositing.mode=mip"},
    {"compositing.mode=average"}};

std::string text_of(const std::vector<std::string>& a, const std::vector<std::string>& b) {
    std::string text;
    for (const auto* list : {&a, &b})
        for (const std::string& setting : *list) text += setting + ' ';
    return text;
}

TEST(Cost, CountsWhatAnIndependentWordCountsForEveryMethodAndModel) {
    for (const auto& method : kMethods)
        for (const auto& variant : kVariants) {
            std::vector<std::string> settings = method;
            settings.insert(settings.end(), variant.begin(), variant.end());
            // Slab methods do not take a field with jumps.
            if (text_of(variant, {}).find("nearest") != std::string::npos && method != kMethods.front())
                continue;
            const Plan plan = plan_with(settings);
            LastSlab every;
            counted = {};
            HWY_NAMESPACE::any_slab<EveryPath>(plan, every, 2);
            every.close();
            const sweep::Cost cost = sweep::cost_of(plan);
            for (const sweep::StageCost& stage : cost.stages) {
                std::size_t i = 0;
                for (std::size_t part = 0; part < kParts; ++part) {
                    if (kStages[stage_index(static_cast<Part>(part))] != stage.stage) continue;
                    ASSERT_LT(i, stage.parts.size());
                    EXPECT_EQ(counts_of(stage.parts[i].bill), every.counts[part])
                        << stage.parts[i].what << ": " << text_of(method, variant);
                    ++i;
                }
            }
        }
}

// A ray's words, each of which varies from ray to ray.
RayWords<OnePath> words_of(const Plan& plan, const RaySetup& ray) {
    auto words = HWY_NAMESPACE::ray_words<OnePath>(plan, ray);
    for (auto* vector : {&words.first, &words.last, &words.step, &words.view})
        for (OnePath& word : *vector) word.is_constant = false;
    for (auto& half : words.half)
        for (OnePath& word : half) word.is_constant = false;
    words.last_index.is_constant = words.last_length.is_constant = false;
    return words;
}
// What all rays of a picture take, counted by the word itself on the path that each takes.  As cast_ray(), whose
// slabs' numbers and first pixel are constants to a word that sees one ray.
AllSlabs counts_of_picture(const Plan& plan, std::int64_t& slabs_taken) {
    AllSlabs all;
    const auto cast = [&](const auto& method, const RaySetup& ray) -> std::int64_t {
        const auto words = words_of(plan, ray);
        const VaryingVoxels voxels{{*plan.volume}};
        const auto at = [](std::int64_t k) { return varying<false>(k); };
        counted = {};  // setting up a ray is none of its slabs
        HWY_NAMESPACE::Slabs slabs(plan, method, voxels, words, at(ray.slabs), all);
        for (OnePath& color : slabs.pixel.color) color.is_constant = false;
        slabs.pixel.transparency.is_constant = false;
        if (plan.projection_mode) {
            const CompositingMode mode = plan.scene.compositing.mode;
            OnePath kept = slabs.sample(at(0)).input;
            for (std::int64_t k = 1; k <= ray.slabs; ++k)
                kept = HWY_NAMESPACE::merge_samples(mode, kept, slabs.sample(at(k)).input);
            if (mode == CompositingMode::average) kept = at(0);
            slabs.project({kept, at(0), at(ray.slabs), words.last_length});
            return ray.slabs;
        }
        const bool backwards = plan.compositing.form == CompositingForm::back_to_front;
        std::int64_t taken = 0;
        for (std::int64_t i = 0; i < ray.slabs; ++i, ++taken) {
            if (!backwards && i > 0 && !slabs.goes_on()) break;
            slabs.step(at(backwards ? ray.slabs - 1 - i : i));
        }
        return taken;
    };
    for (int row = 0; row < plan.camera.height; ++row)
        for (int column = 0; column < plan.camera.width; ++column) {
            const RaySetup ray = plan.set_up(column, row);
            if (ray.slabs == 0) continue;
            slabs_taken += std::visit([&](const auto& method) { return cast(method, ray); }, plan.method);
            all.close();
        }
    return all;
}

TEST(Cost, TheMeanIsWhatAnIndependentWordCountsOnThePathsThatAPictureTakes) {
    for (const auto& method : kMethods)
        for (const auto& variant : kTakenVariants) {
            std::vector<std::string> settings = method;
            settings.insert(settings.end(), variant.begin(), variant.end());
            settings.insert(settings.end(), {"image.width=8", "image.height=6", "camera.height=16"});
            const std::string text = text_of(method, variant);
            const bool has_parts =
                text.find("pips") != std::string::npos || text.find("leg") != std::string::npos;
            if (text.find("interpolation=nearest") != std::string::npos && method != kMethods.front())
                continue;
            if (text.find("adaptive") != std::string::npos && !has_parts) continue;
            const Plan plan = plan_with(settings);
            std::int64_t slabs = 0;
            const AllSlabs all = counts_of_picture(plan, slabs);
            ASSERT_GT(slabs, 20);
            const sweep::Cost cost = sweep::cost_of_picture(plan, 8);
            ASSERT_TRUE(cost.taken);
            EXPECT_EQ(cost.taken->slabs, slabs);
            for (const sweep::StageCost& stage : cost.stages)
                for (const sweep::PartCost& part : stage.parts)
                    EXPECT_EQ(counts_of(part.taken), all.counts[static_cast<std::size_t>(part.part)])
                        << part.what << ": " << text_of(method, variant);
        }
}

// A thin fog, lit, in one slab a ray that is shorter than a step: every slab takes the dearest path.
TEST(Cost, WhereEverySampleTakesTheDearestPathTheMeanIsTheDearest) {
    const Plan plan = plan_with({"transfer_function.points=[[0, 1, 1, 1, 0.01], [4095, 1, 1, 1, 0.01]]",
                                 "transfer_function.unit_distance=1", "sampling.step=64", "image.width=12",
                                 "image.height=12", "camera.height=8"});
    ASSERT_TRUE(plan.lit);
    const sweep::Cost cost = sweep::cost_of_picture(plan, 12);
    ASSERT_TRUE(cost.taken);
    EXPECT_EQ(cost.taken->rays, 144);
    EXPECT_EQ(cost.taken->slabs, 144);
    for (const sweep::StageCost& stage : cost.stages) {
        EXPECT_GT(sweep::operation_bits(stage.bill), 0) << stage.stage;
        EXPECT_EQ(sweep::operation_bits(stage.taken), 144 * sweep::operation_bits(stage.bill)) << stage.stage;
        EXPECT_EQ(stage.taken.lookups, 144 * stage.bill.lookups) << stage.stage;
    }
    const nlohmann::ordered_json json = sweep::json_of(cost);
    EXPECT_EQ(json["mean_bits"].get<double>(), json["bits"].get<double>());
}

TEST(Cost, ATransparentPictureIsNeitherLitNorShaded) {
    const Plan plan =
        plan_with({"transfer_function.points=[[0, 1, 1, 1, 0], [4080, 1, 1, 1, 0], [4095, 1, 1, 1, 0.5]]",
                   "transfer_function.unit_distance=1", "volume.procedural=sphere", "volume.dims=16",
                   "image.width=8", "image.height=8", "camera.height=16"});
    ASSERT_TRUE(plan.lit);
    const sweep::Cost cost = sweep::cost_of_picture(plan, 8);
    ASSERT_TRUE(cost.taken);
    ASSERT_GT(cost.taken->slabs, 100);
    for (const sweep::StageCost& stage : cost.stages) {
        const bool is_lighting = stage.stage == "gradient" || stage.stage == "shading";
        EXPECT_GT(sweep::operation_bits(stage.bill), 0) << stage.stage;
        EXPECT_EQ(counts_of(stage.taken) == Counts{}, is_lighting) << stage.stage;
    }
}

// One slab of the built-in scene, a full step long, on the path that it takes: what a reviewer counted by a
// word of their own (docs/sweeps.md).  Since then sums of pi1d bend between entries wherever that shows over a ray,
// as T does: 16 products and 8 look-ups more.
TEST(Cost, OneSlabOfEveryMethodTakesTheOperationsThatWereCountedBeforehand) {
    struct Row {
        std::vector<std::string> settings;
        std::int64_t products, quotients, lookups;
    };
    const std::vector<Row> rows{{{"classification.method=pc"}, 4, 0, 8},
                                {{"classification.method=pi1d"}, 24, 4, 24},
                                {{"classification.method=pips"}, 13, 4, 20},
                                {{"classification.method=pips", "classification.order=3"}, 66, 27, 41},
                                {{"classification.method=pips", "classification.order=5"}, 140, 54, 57},
                                {{"classification.method=leg", "classification.order=2"}, 38, 18, 33},
                                {{"classification.method=leg", "classification.order=4"}, 100, 39, 49}};
    for (const Row& row : rows) {
        const Plan plan = plan_with(row.settings);
        const auto end = [&](double entry) {
            return varying<false>(static_cast<std::int64_t>(
                std::ldexp(entry, plan.specs[Wire::classification_input].format.fraction_bits)));
        };
        // A translucent, visible stretch of the transfer function.
        double at = -1;
        for (int i = 1; i + 3 < plan.entries.size() && at < 0; ++i)
            if (plan.entries.entry[static_cast<std::size_t>(i)].is_visible() &&
                plan.entries.entry[static_cast<std::size_t>(i) + 2].is_visible())
                at = i;
        ASSERT_GE(at, 0);
        counted = {};
        std::visit(
            [&](const auto& method) {
                HWY_NAMESPACE::classify(method, end(at + 0.25), end(at + 1.75),
                                        constant<OnePath>(std::int64_t{1} << plan.location.length_fraction));
            },
            plan.method);
        EXPECT_EQ(counted.products, row.products) << text_of(row.settings, {});
        EXPECT_EQ(counted.quotients, row.quotients) << text_of(row.settings, {});
        EXPECT_EQ(counted.lookups, row.lookups) << text_of(row.settings, {});
    }
}

TEST(Cost, OneWhiteLightTakesEightProductsOfTwoVariableFactors) {
    const Plan plan = plan_with({"shading.exponent=32"});
    for (const sweep::StageCost& stage : sweep::cost_of(plan).stages) {
        if (stage.stage != "shading") continue;
        EXPECT_EQ(Bill::number(stage.bill.multipliers), 8) << "five squarings, and three colours by a light";
    }
}

TEST(Cost, RoundingIsFreeByTruncationAlone) {
    const auto bits_of = [](const char* rounding) {
        const Plan plan = plan_with(
            {"shading.model=none", std::string("precision.contribution=\"u1.15 ") + rounding + "\""});
        return sweep::operation_bits(sweep::cost_of(plan).stages.back().bill);
    };
    EXPECT_EQ(bits_of("rnd_conv"), bits_of("trn") + 16);
    EXPECT_EQ(bits_of("rnd"), bits_of("trn") + 16);
}

TEST(Cost, AWiderWireWidensEveryOperandItFeeds) {
    const auto bits_of = [](const char* format) {
        const Plan plan =
            plan_with({"shading.model=none", std::string("precision.lerp_x=\"") + format + "\""});
        return sweep::cost_of(plan).stages[1].bill.multiplier_bits();
    };
    // Two lerps along y, by weights of one integer bit and the wire's fraction.
    const Plan plan = plan_with({});
    const int weight = plan.specs[Wire::weight].format.width();
    EXPECT_EQ(bits_of("u14.4"), bits_of("u12.4") + 2 * 2 * weight);
    EXPECT_EQ(bits_of("u12.6"), bits_of("u12.4") + 2 * 2 * weight);
}

TEST(Cost, EveryWireInUseIsHeardOrStandsInATable) {
    // Beside these a picture's audit hears every wire in use.
    const std::vector<Wire> silent{Wire::spacing,      Wire::table_color,      Wire::table_alpha, Wire::light,
                                   Wire::table_moment, Wire::table_extinction, Wire::material};
    for (const auto& method : kMethods) {
        const Plan plan = plan_with(method);
        bool entries = false;
        for (const Wire wire : plan.used_wires) entries = entries || wire == Wire::table_alpha;
        EXPECT_TRUE(entries) << "table_alpha: " << text_of(method, {});
        std::vector<Wire> costed;
        for (const sweep::StageCost& stage : sweep::cost_of(plan).stages)
            costed.insert(costed.end(), stage.wires.begin(), stage.wires.end());
        EXPECT_EQ(costed, plan.used_wires);
        RenderOptions options;
        options.audit = true;
        const RenderStatistics statistics = render(plan, options).statistics;
        for (int w = 0; w < kWires; ++w) {
            const auto wire = static_cast<Wire>(w);
            const bool used =
                std::find(plan.used_wires.begin(), plan.used_wires.end(), wire) != plan.used_wires.end();
            const bool heard = statistics.wires[static_cast<std::size_t>(w)].count > 0;
            const bool may_be_silent = std::find(silent.begin(), silent.end(), wire) != silent.end();
            EXPECT_TRUE(used || !heard) << info(wire).name << ": " << text_of(method, {});
            EXPECT_TRUE(heard || !used || may_be_silent) << info(wire).name << ": " << text_of(method, {});
        }
    }
}

}  // namespace
}  // namespace squint
