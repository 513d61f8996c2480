#include "pipeline/machines/certificate.h"

#include "core/error.h"
#include "core/parallel.h"
#include "pipeline/machines/certificate/methods.h"
#include "pipeline/machines/certificate/premultiplied.h"
#include "pipeline/machines/certificate/ray.h"
#include "pipeline/machines/certificate/stages.h"
#include "pipeline/plan/ranges.h"
#include "pipeline/record.h"
#include "pipeline/render.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

namespace squint {
namespace {

using namespace HWY_NAMESPACE;

/// One row's rays.
struct Row {
    std::vector<float> most;  // of each ray that met the volume, LSB8
    Certificate part;
};

template <class M>
void certify_row(const Plan& plan, const M& bounded_method, int row, const CertificateOptions& options,
                 Image* image, Row& to) {
    const int every = std::max(options.every, 1);
    const BoundedVolume voxels{*plan.volume, plan.interpolation.weight_bits};
    BoundedRay ray(plan, options.known);
    for (int column = 0; column < plan.camera.width; column += every) {
        const RaySetup setup = plan.set_up(column, row);
        if (setup.slabs == 0) continue;
        ray.begin();
        Pixel<Bounded> pixel;
        cast_ray(plan, bounded_method, voxels, ray_words<Bounded>(plan, setup), setup.slabs, ray, pixel);
        std::array<Shares, 4> bound = ray.bound(pixel.samples < setup.slabs);
        const Accumulated<Bounded>& words = pixel.gathered;
        BoundedRay::limit(bound,
                          color_of(plan.compositing, Accumulated<double>{{in_double(words.color[0].v),
                                                                          in_double(words.color[1].v),
                                                                          in_double(words.color[2].v)},
                                                                         in_double(words.transparency.v)}),
                          ray.brightest());
        Certificate& part = to.part;
        ++part.rays;
        double most = 0;
        std::array<bool, kDoubtNames.size()> doubts{};
        Shares ray_greatest, ray_shares;
        for (std::size_t c = 0; c < 4; ++c) {
            const Shares lsb8 = bound[c].scaled(255);
            const double sum = lsb8.sum();
            if (sum > most) most = sum, ray_shares = lsb8;
            ray_greatest = greatest(ray_greatest, lsb8);
            constexpr std::array<int, kDoubtNames.size()> kDoubtful{kWallsPay, kTerminationPays,
                                                                    kGradientsPay};
            for (std::size_t d = 0; d < doubts.size(); ++d)
                doubts[d] =
                    doubts[d] ||
                    lsb8[kDoubtful[d]] > (kDoubtful[d] == kTerminationPays ? kUndecided : options.undecided);
            if (sum > part.most)
                part.most = sum, part.shares = lsb8, part.column = column, part.row = row,
                part.channel = static_cast<int>(c);
            if (image) {
                const std::size_t at =
                    static_cast<std::size_t>(row) * static_cast<std::size_t>(image->width) +
                    static_cast<std::size_t>(column);
                const double value = options.payer < 0 ? bound[c].sum() : bound[c][options.payer];
                auto stored = static_cast<float>(value);
                if (static_cast<double>(stored) < value) stored = std::nextafter(stored, 2.0f);
                image->channels[c].values[at] = stored;
            }
        }
        for (std::size_t d = 0; d < doubts.size(); ++d) part.undecided[d] += doubts[d];
        part.greatest = greatest(part.greatest, ray_greatest);
        if (std::find(doubts.begin(), doubts.end(), true) != doubts.end()) {
            ++part.undecided_rays;
        } else {
            part.greatest_decided = greatest(part.greatest_decided, ray_greatest);
            if (most > part.most_decided) part.most_decided = most, part.shares_decided = ray_shares;
        }
        to.most.push_back(static_cast<float>(most));
    }
}

}  // namespace

std::string_view payer_name(int payer) {
    if (payer < kWires) return kWireInfo[static_cast<std::size_t>(payer)].name;
    constexpr std::array<std::string_view, kPayers - kWires> kNames{"rows of tables", "walls", "termination",
                                                                    "gradients", "doubles"};
    return payer < kPayers ? kNames[static_cast<std::size_t>(payer - kWires)] : "constants";
}

std::vector<std::pair<std::string_view, double>> shares_by_stage(const Certificate& certificate) {
    std::vector<std::pair<std::string_view, double>> all;
    for (const std::string_view stage : kStages) {
        double sum = 0;
        for (int p = 0; p < kWires; ++p)
            if (kWireInfo[static_cast<std::size_t>(p)].stage == stage) sum += certificate.shares[p];
        all.emplace_back(stage, sum);
    }
    for (int p = kWires; p < kPayers; ++p) all.emplace_back(payer_name(p), certificate.shares[p]);
    all.emplace_back(payer_name(Shares::kElsewhere), certificate.shares[Shares::kElsewhere]);
    return all;
}

nlohmann::ordered_json json_of(const Certificate& c) {
    using Json = nlohmann::ordered_json;
    Json stages = Json::object(), payers = Json::object(), undecided = Json::object();
    for (const auto& stage : shares_by_stage(c)) stages[std::string(stage.first)] = stage.second;
    for (int p = 0; p < Shares::kMost; ++p)
        if (c.greatest[p] > 0)
            payers[std::string(payer_name(p))] = {{"share_lsb8", c.shares[p]},
                                                  {"greatest_lsb8", c.greatest[p]}};
    for (std::size_t d = 0; d < kDoubtNames.size(); ++d)
        undecided[std::string(kDoubtNames[d])] = c.undecided[d];
    return {{"most_lsb8", c.most},
            {"median_lsb8", c.median},
            {"most_decided_lsb8", c.most_decided},
            {"at", {c.column, c.row}},
            {"channel", std::string(1, "RGBA"[c.channel])},
            {"rays", c.rays},
            {"undecided_rays", c.undecided_rays},
            {"undecided", undecided},
            {"stages_lsb8", stages},
            {"payers", payers}};
}

std::optional<std::string> what_is_not_bounded(const Plan& plan) {
    if (plan.real)
        return fmt::format("precision.preset {} rounds nothing; allowed: any other preset", plan.real_name());
    if (plan.scene.classification.as_printed)
        return "classification.as_printed is not bounded; allowed: false";
    const WallRule walls = plan.scene.classification.opaque_prediction;
    if (!std::holds_alternative<PostClassification>(plan.method) && plan.entries.any_opaque() &&
        walls == WallRule::none)
        return fmt::format(
            "opaque entries with classification.opaque_prediction {} are not bounded yet; "
            "allowed: ends, twice",
            name_of(walls));
    if (!plan.lit) return {};
    if (plan.inside.rule == InsideRule::adaptive && plan.inside.one_alpha < 1 << 15)
        return "shading.inside adaptive cuts other slabs where precision.slab_alpha has few bits; allowed: "
               "15 or more fraction bits";
    return {};
}

int every_for_some_rays(const Plan& plan, std::size_t pictures) {
    constexpr double kLongRay = 512;
    const double longer = std::max(most_steps(plan) / kLongRay, 1.0),
                 most = kSomeRays / (longer * longer * static_cast<double>(pictures));
    int every = 1;
    const auto along = [&](int pixels) { return static_cast<double>((pixels + every - 1) / every); };
    while (along(plan.camera.width) * along(plan.camera.height) > std::max(most, 1.0)) ++every;
    return every;
}

Certificate certify(const Plan& plan, const CertificateOptions& options) {
    if (const auto obstacle = what_is_not_bounded(plan)) throw InputError("--bound: " + *obstacle);
    const Function function(plan);
    Certificate all;
    Image* image = nullptr;
    if (options.channels) {
        all.image.width = plan.camera.width, all.image.height = plan.camera.height;
        for (const char* name : {"bound.R", "bound.G", "bound.B", "bound.A"}) all.image.add_float(name);
        image = &all.image;
    }
    std::vector<Row> rows(static_cast<std::size_t>(plan.camera.height));
    const int every = std::max(options.every, 1), wanted = (plan.camera.height + every - 1) / every;
    std::atomic<bool> stopped{false};
    std::atomic<int> done{0};
    const auto certify_all = [&](const auto& method) {
        on_threads(options.threads, [&] {
            in_parallel(plan.camera.height, [&](int row) {
                if (options.cancelled && *options.cancelled) stopped = true;
                if (stopped || row % every != 0) return;
                certify_row(plan, method, row, options, image, rows[static_cast<std::size_t>(row)]);
                if (options.progress) options.progress(static_cast<double>(++done) / wanted);
            });
        });
    };
    const Plan real = std::holds_alternative<PostClassification>(plan.method) ? plan : real_plan(plan);
    const auto prefix_of = [&]<class M>(const M& words) {
        return BoundedPrefix{words.prefix, std::get<M>(real.method).prefix, real.inside, function};
    };
    if (const auto* words = std::get_if<PostClassification>(&plan.method)) {
        certify_all(BoundedPostClassification{*words, function});
    } else if (const auto* cells = std::get_if<PreIntegrated2D>(&plan.method)) {
        certify_all(BoundedCells{*cells, std::get<PreIntegrated2D>(real.method), function, prefix_of(*cells),
                                 cells->fades});
    } else if (const auto* means = std::get_if<PreIntegrated1D>(&plan.method)) {
        const Function of_means = Function::of_means(plan, means->is_opacity);
        certify_all(BoundedMeans{*means, std::get<PreIntegrated1D>(real.method), function, of_means,
                                 prefix_of(*means)});
    } else {
        const bool legendre = plan.scene.classification.method == Method::leg;
        const auto* first = std::get_if<PowerSeriesOfOrder1>(&plan.method);
        const int order = first ? 1 : std::get<MomentSeries>(plan.method).order;
        preintegration::ExactSeries exact = preintegration::build_exact_series(
            plan.entries, order, legendre, plan.scene.classification.opaque_prediction != WallRule::none);
        exact.step = full_step(plan);
        const auto series = [&](const auto& words) {
            return BoundedPowerSeries{&words, function, exact, series_kernel(order, legendre),
                                      prefix_of(words)};
        };
        certify_all(first ? series(*first) : series(std::get<MomentSeries>(plan.method)));
    }
    if (stopped) throw Cancelled{};
    std::vector<float> most;
    for (const Row& row : rows) {
        const Certificate& part = row.part;
        most.insert(most.end(), row.most.begin(), row.most.end());
        all.rays += part.rays;
        if (part.most > all.most)
            all.most = part.most, all.shares = part.shares, all.column = part.column, all.row = part.row,
            all.channel = part.channel;
        if (part.most_decided > all.most_decided)
            all.most_decided = part.most_decided, all.shares_decided = part.shares_decided;
        all.greatest_decided = greatest(all.greatest_decided, part.greatest_decided);
        all.greatest = greatest(all.greatest, part.greatest);
        for (std::size_t d = 0; d < all.undecided.size(); ++d) all.undecided[d] += part.undecided[d];
        all.undecided_rays += part.undecided_rays;
    }
    if (!most.empty()) {
        const auto middle = most.begin() + static_cast<std::ptrdiff_t>(most.size() / 2);
        std::nth_element(most.begin(), middle, most.end());
        all.median = *middle;
    }
    return all;
}

}  // namespace squint