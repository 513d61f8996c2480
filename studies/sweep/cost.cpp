#include "studies/sweep/cost.h"

#include "pipeline/plan/any_slab-inl.h"
#include "studies/sweep/ways.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <stdexcept>

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
    ~BillOfParts() { Tally::bill = nullptr, Tally::ways = nullptr; }
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

void add_times(Bill& sum, const Bill& bill, std::int64_t times) {
    const auto add = [&](auto& to, const auto& from) {
        for (const auto& [widths, count] : from) to[widths] += times * count;
    };
    add(sum.multipliers, bill.multipliers), add(sum.constant_multipliers, bill.constant_multipliers);
    add(sum.dividers, bill.dividers), add(sum.roundings, bill.roundings);
    sum.lookups += times * bill.lookups, sum.lookup_bits += times * bill.lookup_bits;
}

// Runs of one plan read the same columns of its tables.
struct KeptColumns {
    Tally::Columns columns;
    KeptColumns() { Tally::columns = &columns; }
    KeptColumns(const KeptColumns&) = delete;
    ~KeptColumns() { Tally::columns = nullptr; }
};

// Of one slab, on its dearest path, or on the way that slabs of a picture take.
std::array<Bill, kParts> bills_of(const Plan& plan, const SlabWay* way = nullptr) {
    BillOfParts counted(plan);
    std::string ways;
    if (way) ways = way->before + way->ways, Tally::ways = ways.c_str();
    // The second of two neighbours, unless it has none: they share the sample between them.
    any_slab<Tally>(plan, counted, way && way->is_first ? 1 : 2);
    if (way && *Tally::ways != 0)
        throw std::logic_error("a tally leaves the way of the slab that it follows");
    return counted.bills;
}

std::array<Bill, kParts> bills_of_picture(const Plan& plan, const PictureWays& picture) {
    std::array<Bill, kParts> sum;
    const KeptColumns kept;
    for (const SlabWay& way : picture.ways) {
        const std::array<Bill, kParts> one = bills_of(plan, &way);
        for (std::size_t part = 0; part < kParts; ++part) {
            // A projected ray samples the ends of all its slabs, and is classified once.
            const bool samples = plan.projection_mode && part <= static_cast<std::size_t>(Part::input);
            add_times(sum[part], one[part], samples ? 0 : way.slabs);
            if (samples && &way == &picture.ways.front())
                add_times(sum[part], one[part], picture.slabs + picture.rays);
        }
    }
    return sum;
}

Cost cost_with(const Plan& plan, const PictureWays* picture) {
    Cost cost;
    const std::array<Bill, kParts> bills = bills_of(plan);
    std::array<Bill, kParts> taken;
    if (picture) taken = bills_of_picture(plan, *picture), cost.taken = {picture->rays, picture->slabs, {}};
    for (std::size_t s = 0; s < plan.stages.size(); ++s) {
        if (!plan.stages[s].modelled) continue;
        StageCost stage{plan.stages[s].name, {}, 0, {}, {}, {}, plan.stages[s].needs};
        for (const Wire wire : plan.used_wires)
            if (info(wire).stage == stage.stage)
                stage.wires.push_back(wire), stage.word_bits += width(plan, wire);
        for (std::size_t part = 0; part < kParts; ++part) {
            if (stage_index(static_cast<Part>(part)) != s) continue;
            stage.parts.push_back(
                {static_cast<Part>(part), std::string(kPartNames[part]), bills[part], taken[part]});
            stage.bill.merge(bills[part]), stage.taken.merge(taken[part]);
        }
        if (stage.stage == "classification")
            cost.entry_bytes = static_cast<double>(stage.bill.lookup_bits) / 8;
        cost.word_bits += stage.word_bits, cost.bill.merge(stage.bill);
        if (cost.taken) cost.taken->bill.merge(stage.taken);
        cost.stages.push_back(std::move(stage));
    }
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

}  // namespace

Cost cost_of(const Plan& plan) {
    return cost_with(plan, nullptr);
}
Cost cost_of_picture(const Plan& plan, int most_rays) {
    const PictureWays picture = ways_of(plan, most_rays);
    return cost_with(plan, &picture);
}

namespace {

using Json = nlohmann::ordered_json;

// A mean of the slabs of a picture.
double mean(const Cost::Taken& of, std::int64_t sum) {
    return of.slabs > 0 ? static_cast<double>(sum) / static_cast<double>(of.slabs) : 0;
}

// One kind of operation of a part: its number on the dearest path and in the mean, by widths.
void add_operations(Json& list, const PartCost& part, std::map<Bill::Widths, std::int64_t> Bill::*kind,
                    const Cost& cost) {
    std::map<Bill::Widths, std::pair<std::int64_t, std::int64_t>> both;
    for (const auto& [widths, count] : part.bill.*kind) both[widths].first = count;
    for (const auto& [widths, count] : part.taken.*kind) both[widths].second = count;
    for (const auto& [widths, counts] : both) {
        list.push_back(
            {{"what", part.what}, {"count", counts.first}, {"widths", {widths.first, widths.second}}});
        if (cost.taken) list.back()["mean"] = mean(*cost.taken, counts.second);
    }
}
void add_bits(Json& json, const Bill& bill) {
    json["multiplier_bits"] = bill.multiplier_bits();
    json["divider_bits"] = bill.divider_bits();
    json["rounding_bits"] = bill.rounding_bits();
    json["constant_multiplier_bits"] = bill.constant_multiplier_bits();
    json["lookups"] = bill.lookups;
    json["lookup_bits"] = bill.lookup_bits;
}
void add_means(Json& json, const Bill& taken, const Cost& cost) {
    if (!cost.taken) return;
    Json sums;
    add_bits(sums, taken);
    for (const auto& [name, sum] : sums.items())
        json["mean_" + name] = mean(*cost.taken, sum.get<std::int64_t>());
}

}  // namespace

nlohmann::ordered_json json_of(const Cost& cost) {
    Json stages = Json::object();
    for (const StageCost& stage : cost.stages) {
        Json multipliers = Json::array(), dividers = Json::array(), constant = Json::array();
        for (const PartCost& part : stage.parts) {
            add_operations(multipliers, part, &Bill::multipliers, cost);
            add_operations(dividers, part, &Bill::dividers, cost);
            add_operations(constant, part, &Bill::constant_multipliers, cost);
        }
        Json& json = stages[stage.stage] = {{"word_bits", stage.word_bits}};
        add_bits(json, stage.bill);
        add_means(json, stage.taken, cost);
        json["operand_bits"] = stage.needs.operand_bits;
        json["result_bits"] = stage.needs.result_bits;
        json["multipliers"] = multipliers;
        json["dividers"] = dividers;
        json["constant_multipliers"] = constant;
    }
    Json json{{"bits", cost.bits()}, {"word_bits", cost.word_bits}};
    add_bits(json, cost.bill);
    if (cost.taken) {
        json["mean_bits"] =
            static_cast<double>(cost.word_bits) + mean(*cost.taken, operation_bits(cost.taken->bill));
        add_means(json, cost.taken->bill, cost);
        json["mean_of"] = {{"rays", cost.taken->rays}, {"slabs", cost.taken->slabs}};
    }
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
