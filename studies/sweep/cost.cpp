#include "studies/sweep/cost.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <set>
#include <variant>

namespace squint::sweep {
namespace {

int width(const Plan& plan, Wire wire) {
    return plan.specs[wire].format.width();
}
int fraction(const Plan& plan, Wire wire) {
    return plan.specs[wire].format.fraction_bits;
}

/// A method's tables, and the wires it rounds to.
struct MethodParts {
    struct Part {
        std::int64_t rows, columns, bytes;
        int wire;
    };
    int seen = 0;
    std::int64_t entry_bytes = 0;  // of the entries themselves, in words: every method holds them
    std::vector<Part> tables;      // beside them
    std::set<Wire> wires;
    void operator()(const Rescale& r) { add(r.wire); }
    void operator()(const Table& t) {
        if (t.rows() == 0) return;
        if (seen++ < 2)  // EntryLookup's own two come first in every method
            entry_bytes += static_cast<std::int64_t>(t.bytes());
        else
            tables.push_back({t.rows(), t.columns(), static_cast<std::int64_t>(t.bytes()), t.wire});
        add(t.wire);
    }
    void operator()(const CellTable& t) {
        tables.push_back({t.rows(), t.columns(), static_cast<std::int64_t>(t.bytes()), t.wire});
        add(t.wire);
    }

  private:
    void add(int wire) {
        if (wire >= 0) wires.insert(static_cast<Wire>(wire));
    }
};
MethodParts parts_of(const Plan& plan) {
    MethodParts parts;
    ClassificationMethod copy = plan.method;
    std::visit([&](auto& method) { method.visit(parts); }, copy);
    return parts;
}

bool premultiplied(const Plan& plan) {
    return plan.shading.premultiplied;
}
bool straight(const Plan& plan) {  // the form multiplies colour by w instead of carrying it premultiplied
    return plan.compositing.form == CompositingForm::w && !premultiplied(plan);
}

std::vector<Wire> wires_of_stage(const Plan& plan, std::size_t stage) {
    const bool trilinear = plan.scene.sampling.interpolation == InterpolationRule::trilinear;
    std::vector<Wire> wires;
    switch (stage) {
        case 0:
            return {Wire::location, Wire::direction, Wire::weight, Wire::length};
        case 1:
            return trilinear ? std::vector{Wire::lerp_x, Wire::lerp_y, Wire::sample}
                             : std::vector{Wire::sample};
        case 2:
            wires = {Wire::gradient, Wire::normal};
            if (plan.gradient.rule != GradientRule::central_samples) wires.push_back(Wire::gradient_lerp);
            if (!plan.gradient.isotropic) wires.push_back(Wire::spacing);
            return wires;
        case 3: {
            std::set<Wire> used = parts_of(plan).wires;
            used.insert({Wire::classification_input, Wire::table_color, Wire::table_alpha,
                         Wire::table_extinction, Wire::slab_alpha});
            used.insert(premultiplied(plan) ? Wire::slab_color : Wire::slab_ratio);
            if (premultiplied(plan) && !std::visit([](const auto& m) { return m.kNeedsBack; }, plan.method))
                used.erase(Wire::slab_ratio);
            if (!premultiplied(plan) && !straight(plan)) used.insert(Wire::slab_color);  // on its way to C
            return {used.begin(), used.end()};
        }
        case 4:
            return {Wire::light, Wire::dot, Wire::power, Wire::material, Wire::intensity, Wire::lit_color};
        default:
            wires = {Wire::color, Wire::transparency};
            if (plan.compositing.form == CompositingForm::w || plan.compositing.is_unit255())
                wires.push_back(Wire::contribution);
            return wires;
    }
}

// Bits of a sample's number on the longest ray: the volume's diagonal.
int index_bits(const Plan& plan) {
    const Volume& v = *plan.volume;
    double squares = 0;
    for (int a = 0; a < 3; ++a) {
        const double side = static_cast<double>(v.dims[a] - 1) * v.spacing[a];
        squares += side * side;
    }
    return std::bit_width(static_cast<std::uint64_t>(std::sqrt(squares) / plan.step_world) + 1);
}

// Multipliers of one sample.  A lerp a + w (b - a) is one multiplier of the difference, a bit wider than its
// ends.
std::vector<Multiplier> multipliers_of(const Plan& plan, std::size_t stage) {
    const auto w = [&](Wire wire) { return width(plan, wire); };
    const int scalar = plan.volume->scalar_bits, weight = w(Wire::weight),
              input = fraction(plan, Wire::classification_input);
    std::vector<Multiplier> m;
    switch (stage) {
        case 0:
            if (plan.scene.sampling.position == PositionRule::p0_kv)
                m.push_back({"k V", 3, index_bits(plan), w(Wire::direction)});
            return m;
        case 1:
            if (plan.scene.sampling.interpolation == InterpolationRule::nearest) return m;
            return {{"lerp x", 4, scalar + 1, weight},
                    {"lerp y", 2, w(Wire::lerp_x) + 1, weight},
                    {"lerp z", 1, w(Wire::lerp_y) + 1, weight}};
        case 2:
            switch (plan.gradient.rule) {
                case GradientRule::central:
                case GradientRule::sobel:
                    m.push_back({"lerp x of differences", 12, scalar + 2, weight});
                    m.push_back({"lerp y, z", 9, w(Wire::gradient_lerp) + 1, weight});
                    break;
                case GradientRule::analytic:
                    m.push_back({"lerp y of differences", 6, scalar + 2, weight});
                    m.push_back({"lerp z", 3, w(Wire::gradient_lerp) + 1, weight});
                    break;
                case GradientRule::central_samples:
                    m.push_back({"six samples: lerp x", 24, scalar + 1, weight});
                    m.push_back({"six samples: lerp y", 12, w(Wire::lerp_x) + 1, weight});
                    m.push_back({"six samples: lerp z", 6, w(Wire::lerp_y) + 1, weight});
            }
            if (!plan.gradient.isotropic) m.push_back({"spacing", 3, w(Wire::gradient), w(Wire::spacing)});
            m.push_back({"length: squares", 3, kNormalBits + 1, kNormalBits + 1});
            m.push_back({"length: quotients", 3, w(Wire::gradient), w(Wire::normal)});
            return m;
        case 3: {
            const bool both_ends = plan.needs_back;
            if (input > 0 && !both_ends) {
                m.push_back({"between entries: colour", 3, w(Wire::table_color) + 1, input});
                m.push_back({"between entries: opacity", 1, w(Wire::table_alpha) + 1, input});
            }
            const bool is_2d = plan.scene.classification.method == Method::pi2d ||
                               plan.scene.classification.method == Method::pi2d_no_attenuation;
            if (is_2d && plan.scene.classification.lookup == TableLookup::bilinear && input > 0) {
                m.push_back({"bilinear: colour", 9, w(Wire::slab_color) + 1, input});
                m.push_back({"bilinear: opacity", 3, w(Wire::slab_alpha) + 1, input});
            } else if (both_ends && !is_2d) {
                if (input > 0) {
                    m.push_back({"prefix at both ends: depth", 2, w(Wire::table_extinction) + 1, input});
                    m.push_back({"prefix at both ends: moments", 6, w(Wire::table_moment) + 1, input});
                }
                m.push_back({"mean depth", 1, w(Wire::slab_depth), w(Wire::length)});
                m.push_back({"ratios", 3, w(Wire::slab_ratio), w(Wire::slab_depth)});
                m.push_back({"opacity of depth", 1, w(Wire::slab_alpha) + 1, w(Wire::slab_depth)});
            }
            return m;
        }
        case 4: {
            const int lights = static_cast<int>(plan.scene.lights.size());
            m.push_back({"N.L and N.H", 6 * lights, w(Wire::normal), w(Wire::light)});
            if (plan.scene.shading.power == PowerRule::squaring)
                m.push_back({"squarings", plan.shading.squarings * lights, w(Wire::power), w(Wire::power)});
            else
                m.push_back({"power", lights, w(Wire::power), w(Wire::power)});
            m.push_back({"kd, ks", 2 * lights, w(Wire::material), std::max(w(Wire::dot), w(Wire::power))});
            m.push_back({"diffuse times colour", 3, w(Wire::intensity),
                         premultiplied(plan) ? w(Wire::slab_color) : w(Wire::slab_ratio)});
            return m;
        }
        default: {
            const int color = plan.lit              ? w(Wire::lit_color)
                              : premultiplied(plan) ? w(Wire::slab_color)
                                                    : w(Wire::slab_ratio);
            m.push_back({"alpha T", 1, w(Wire::slab_alpha), w(Wire::transparency)});
            if (straight(plan)) {
                m.push_back({"w times colour", 3, color, w(Wire::contribution)});
            } else {
                if (!premultiplied(plan)) m.push_back({"alpha times colour", 3, color, w(Wire::slab_alpha)});
                m.push_back({"T times colour", 3, color, w(Wire::transparency)});
            }
            return m;
        }
    }
}

std::int64_t entry_bits(const Plan& plan) {
    return 3 * width(plan, Wire::table_color) + width(plan, Wire::table_alpha) +
           width(plan, Wire::table_extinction) + (plan.entries.any_opaque() ? 2 : 0);
}

void count_tables(const Plan& plan, Cost& cost) {
    MethodParts parts = parts_of(plan);
    cost.table_bits = plan.entries.size() * entry_bits(plan);
    cost.table_bytes = parts.entry_bytes;
    std::int64_t row_bits = entry_bits(plan);
    if (const Table& power = plan.shading.power_table; plan.lit && power.rows() > 0)
        parts.tables.push_back({power.rows(), 1, static_cast<std::int64_t>(power.bytes()), power.wire});
    for (const MethodParts::Part& t : parts.tables) {
        const std::int64_t word = t.wire >= 0 ? width(plan, static_cast<Wire>(t.wire))
                                              : 8 * t.bytes / std::max<std::int64_t>(t.rows * t.columns, 1);
        cost.table_bits += t.rows * t.columns * word, cost.table_bytes += t.bytes;
        if (plan.needs_back) row_bits += t.columns * word;
    }
    // Two neighbouring rows at each end of a slab.
    cost.entry_bytes = static_cast<double>(row_bits) / 8 * (plan.needs_back ? 4 : 2);
}

}  // namespace

std::vector<Wire> used_wires(const Plan& plan) {
    std::vector<Wire> wires;
    for (std::size_t s = 0; s < plan.stages.size(); ++s)
        if (plan.stages[s].modelled)
            for (const Wire wire : wires_of_stage(plan, s)) wires.push_back(wire);
    std::sort(wires.begin(), wires.end());
    wires.erase(std::unique(wires.begin(), wires.end()), wires.end());
    return wires;
}

Cost cost_of(const Plan& plan) {
    Cost cost;
    for (std::size_t s = 0; s < plan.stages.size(); ++s) {
        if (!plan.stages[s].modelled) continue;
        StageCost stage{plan.stages[s].name, wires_of_stage(plan, s), 0, multipliers_of(plan, s), 0,
                        plan.stages[s].needs};
        for (const Wire wire : stage.wires) stage.word_bits += width(plan, wire);
        for (const Multiplier& m : stage.multipliers) stage.multiplier_bits += m.bits();
        cost.word_bits += stage.word_bits, cost.multiplier_bits += stage.multiplier_bits;
        cost.stages.push_back(std::move(stage));
    }
    count_tables(plan, cost);
    cost.pixel_bits = 3 * width(plan, Wire::color) + width(plan, Wire::transparency);
    cost.buffer_bytes = (cost.pixel_bits * plan.camera.width * plan.camera.height + 7) / 8;
    const auto scalar = static_cast<double>(plan.volume->scalar_bytes());
    const bool trilinear = plan.scene.sampling.interpolation == InterpolationRule::trilinear;
    cost.voxel_bytes = (trilinear ? 8 : 1) * scalar;
    if (plan.lit) {
        // Voxels around a cell that each rule reads, the cell's own eight included.
        constexpr std::array<double, 4> kVoxels{32, 56, 8, 64};
        cost.lit_voxel_bytes = kVoxels[static_cast<std::size_t>(plan.gradient.rule)] * scalar;
    }
    return cost;
}

nlohmann::ordered_json json_of(const Cost& cost) {
    using Json = nlohmann::ordered_json;
    Json stages = Json::object();
    for (const StageCost& stage : cost.stages) {
        Json multipliers = Json::array();
        for (const Multiplier& m : stage.multipliers)
            multipliers.push_back({{"what", m.what}, {"count", m.count}, {"widths", {m.a, m.b}}});
        stages[stage.stage] = {{"word_bits", stage.word_bits},
                               {"multiplier_bits", stage.multiplier_bits},
                               {"operand_bits", stage.needs.operand_bits},
                               {"result_bits", stage.needs.result_bits},
                               {"multipliers", multipliers}};
    }
    return {{"bits", cost.bits()},
            {"word_bits", cost.word_bits},
            {"multiplier_bits", cost.multiplier_bits},
            {"table_bits", cost.table_bits},
            {"table_bytes", cost.table_bytes},
            {"pixel_bits", cost.pixel_bits},
            {"buffer_bytes", cost.buffer_bytes},
            {"voxel_bytes_per_sample", cost.voxel_bytes},
            {"voxel_bytes_per_lit_sample", cost.lit_voxel_bytes},
            {"entry_bytes_per_sample", cost.entry_bytes},
            {"stages", stages}};
}

}  // namespace squint::sweep
