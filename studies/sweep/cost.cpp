#include "studies/sweep/cost.h"

#include "pipeline/plan/any_slab-inl.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>

namespace squint::sweep {
namespace {

using namespace HWY_NAMESPACE;

int width(const Plan& plan, Wire wire) {
    return plan.specs[wire].format.width();
}

constexpr std::array<std::string_view, kParts> kPartNames{
    "location", "interpolation", "input", "gradient", "normal", "classification", "shading", "compositing"};

// Counts the operations of the last slab, part by part.
class BillOfParts : public Silent {
  public:
    std::array<Bill, kParts> bills;

    explicit BillOfParts(const Plan& plan) {
        Tally::wires.fill(0);
        for (int w = 0; w < kWires; ++w)
            Tally::wires[static_cast<std::size_t>(w)] = width(plan, static_cast<Wire>(w));
    }
    BillOfParts(const BillOfParts&) = delete;
    ~BillOfParts() { Tally::bill = nullptr; }
    void slab(const Tally&) { bills = {}; }
    void at(Part part) { Tally::bill = &bills[static_cast<std::size_t>(part)]; }
};

// Tables: at the widths of their wires, and as this program stores them.
struct SumTables {
    Cost& cost;
    void operator()(const Rescale&) const {}
    void operator()(const Table& t) const {
        for (int c = 0; t.rows() > 0 && c < t.columns(); ++c)
            cost.table_bits += std::int64_t{t.rows()} * gather(t, Tally{}, c).width();
        cost.table_bytes += static_cast<std::int64_t>(t.bytes());
    }
    void operator()(const CellTable& t) const {
        for (const Tally& word : gather_cell(t, Tally{}, Tally{})) cost.table_bits += t.rows() * word.width();
        cost.table_bytes += static_cast<std::int64_t>(t.bytes());
    }
};

}  // namespace

Cost cost_of(const Plan& plan) {
    Cost cost;
    BillOfParts counted(plan);
    any_slab<Tally>(plan, counted,
                    2);  // the second of two neighbours: they share the sample between them
    for (std::size_t s = 0; s < plan.stages.size(); ++s) {
        if (!plan.stages[s].modelled) continue;
        StageCost stage{plan.stages[s].name, {}, 0, {}, {}, plan.stages[s].needs};
        for (const Wire wire : plan.used_wires)
            if (info(wire).stage == stage.stage)
                stage.wires.push_back(wire), stage.word_bits += width(plan, wire);
        for (std::size_t part = 0; part < kParts; ++part) {
            if (stage_index(static_cast<Part>(part)) != s) continue;
            stage.parts.emplace_back(kPartNames[part], counted.bills[part]);
            stage.bill.merge(counted.bills[part]);
        }
        if (stage.stage == "classification")
            cost.entry_bytes = static_cast<double>(stage.bill.lookup_bits) / 8;
        cost.word_bits += stage.word_bits, cost.bill.merge(stage.bill);
        cost.stages.push_back(std::move(stage));
    }
    Tally::bill = nullptr;
    Plan visited = plan;
    std::visit([&](auto& method) { method.visit(SumTables{cost}); }, visited.method);
    if (plan.lit) SumTables{cost}(plan.shading.power_table);
    cost.pixel_bits = 3 * width(plan, Wire::color) + width(plan, Wire::transparency);
    cost.buffer_bytes = (cost.pixel_bits * plan.camera.width * plan.camera.height + 7) / 8;
    const auto scalar = static_cast<double>(plan.volume->scalar_bytes());
    const bool trilinear = plan.scene.sampling.interpolation == InterpolationRule::trilinear;
    cost.voxel_bytes = (trilinear ? 8 : 1) * scalar;
    if (plan.lit) {
        // The voxels around a cell that each rule reads, with the cell's own eight.
        constexpr std::array<double, 4> kVoxels{32, 56, 8, 64};
        cost.lit_voxel_bytes = kVoxels[static_cast<std::size_t>(plan.gradient.rule)] * scalar;
    }
    return cost;
}

namespace {

using Json = nlohmann::ordered_json;

void add_operations(Json& list, const std::string& part,
                    const std::map<Bill::Widths, std::int64_t>& operations) {
    for (const auto& [widths, count] : operations)
        list.push_back({{"what", part}, {"count", count}, {"widths", {widths.first, widths.second}}});
}
void add_bits(Json& json, const Bill& bill) {
    json["multiplier_bits"] = bill.multiplier_bits();
    json["divider_bits"] = bill.divider_bits();
    json["rounding_bits"] = bill.rounding_bits();
    json["constant_multiplier_bits"] = bill.constant_multiplier_bits();
    json["lookups"] = bill.lookups;
    json["lookup_bits"] = bill.lookup_bits;
}

}  // namespace

nlohmann::ordered_json json_of(const Cost& cost) {
    Json stages = Json::object();
    for (const StageCost& stage : cost.stages) {
        Json multipliers = Json::array(), dividers = Json::array(), constant = Json::array();
        for (const auto& [part, bill] : stage.parts) {
            add_operations(multipliers, part, bill.multipliers);
            add_operations(dividers, part, bill.dividers);
            add_operations(constant, part, bill.constant_multipliers);
        }
        Json& json = stages[stage.stage] = {{"word_bits", stage.word_bits}};
        add_bits(json, stage.bill);
        json["operand_bits"] = stage.needs.operand_bits;
        json["result_bits"] = stage.needs.result_bits;
        json["multipliers"] = multipliers;
        json["dividers"] = dividers;
        json["constant_multipliers"] = constant;
    }
    Json json{{"bits", cost.bits()}, {"word_bits", cost.word_bits}};
    add_bits(json, cost.bill);
    json["table_bits"] = cost.table_bits;
    json["table_bytes"] = cost.table_bytes;
    json["pixel_bits"] = cost.pixel_bits;
    json["buffer_bytes"] = cost.buffer_bytes;
    json["voxel_bytes_per_sample"] = cost.voxel_bytes;
    json["voxel_bytes_per_lit_sample"] = cost.lit_voxel_bytes;
    json["entry_bytes_per_sample"] = cost.entry_bytes;
    json["stages"] = stages;
    return json;
}

}  // namespace squint::sweep
