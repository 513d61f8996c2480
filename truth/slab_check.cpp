#include "truth/slab_check.h"

#include "pipeline/classification/methods-inl.h"
#include "pipeline/classification/tables/exact_slab.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>

namespace squint {
namespace {

constexpr std::size_t kMostPlaces = 16;  // places^2 slabs, and as many half ones

int input_fraction(const Plan& plan) {
    return plan.specs[Wire::classification_input].format.fraction_bits;
}

/// Entries where the function bends, opaque ones among them, the sharpest bends first.
std::vector<int> knots_of(const Entries& entries) {
    std::vector<std::pair<double, int>> bends;
    for (int i = 1; i + 1 < entries.size(); ++i) {
        const Entry &before = entries.entry[static_cast<std::size_t>(i) - 1],
                    &here = entries.entry[static_cast<std::size_t>(i)],
                    &after = entries.entry[static_cast<std::size_t>(i) + 1];
        const Vec3 color = before.color + after.color - here.color * 2;
        double bend =
            std::abs(before.extinction + after.extinction - 2 * here.extinction) * entries.unit_distance +
            std::abs(color.x) + std::abs(color.y) + std::abs(color.z);
        if (here.opaque) bend += 1000;
        if (bend > 1e-9) bends.push_back({bend, i});
    }
    std::stable_sort(bends.begin(), bends.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    std::vector<int> knots;
    for (const auto& bend : bends) knots.push_back(bend.second);
    return knots;
}

}  // namespace

std::vector<HardSlab> hard_slabs(const Plan& plan) {
    const int last = plan.entries.size() - 1, bits = input_fraction(plan);
    std::set<int> places{0, last / 2, last / 2 + 1, last};
    for (const int knot : knots_of(plan.entries))
        for (const int beside : {0, -1, 1, -9, 9})
            if (places.size() < kMostPlaces) places.insert(std::clamp(knot + beside, 0, last));
    const std::int64_t full = plan.specs[Wire::length].format.one();
    std::vector<HardSlab> slabs;
    const auto add = [&](std::int64_t front, std::int64_t back) {
        slabs.push_back({front, back, full}), slabs.push_back({front, back, full / 2});
    };
    for (const int front : places) {
        const std::int64_t raw = std::int64_t{front} << bits;
        for (const int back : places) add(raw, std::int64_t{back} << bits);
        if (front < last) add(raw, raw + 1), add(raw + 1, raw);
    }
    return slabs;
}

SlabCheck check_slabs(const Plan& plan, bool against_exact) {
    const bool premultiplied = plan.shading.premultiplied;
    const double input = std::ldexp(1.0, -input_fraction(plan));
    const double step = plan.step_world / static_cast<double>(plan.specs[Wire::length].format.one());
    const double color_unit =
        1 / static_cast<double>(plan.specs[premultiplied ? Wire::slab_color : Wire::slab_ratio].format.one());
    const double alpha_unit = 1 / static_cast<double>(plan.specs[Wire::slab_alpha].format.one());
    SlabCheck check;
    for (const HardSlab& s : hard_slabs(plan)) {
        const Slab<Int128> slab = std::visit(
            [&](const auto& m) {
                return HWY_NAMESPACE::classify(m, Int128{s.front}, Int128{s.back}, Int128{s.length});
            },
            plan.method);
        preintegration::SlabValue exact;
        if (against_exact)
            exact = preintegration::exact_slab(plan.entries, static_cast<double>(s.front) * input,
                                               static_cast<double>(s.back) * input,
                                               static_cast<double>(s.length) * step);
        const double alpha = static_cast<double>(slab.alpha) * alpha_unit;
        double color_error = 0;
        bool beyond = alpha < 0 || alpha > 1;
        for (int c = 0; c < 3; ++c) {
            const double color = static_cast<double>(slab.color[static_cast<std::size_t>(c)]) * color_unit *
                                 (premultiplied ? 1 : alpha);
            beyond = beyond || color < 0 || color > alpha;
            color_error = std::max(color_error, 255 * std::abs(color - exact.color[c]));
        }
        const double alpha_error = 255 * std::abs(alpha - exact.alpha);
        if (std::max(color_error, alpha_error) > std::max(check.largest_color, check.largest_alpha))
            check.worst = s;
        check.largest_color = std::max(check.largest_color, color_error);
        check.largest_alpha = std::max(check.largest_alpha, alpha_error);
        check.beyond += beyond;
        ++check.slabs;
    }
    return check;
}

std::vector<NamedMethod> every_method() {
    std::vector<NamedMethod> methods;
    for (std::size_t i = 0; i < std::size(EnumNames<Method>::names); ++i) {
        const auto method = static_cast<Method>(i);
        if (method == Method::pc_mid) continue;  // a slab of pc, sampled elsewhere
        const Orders orders = orders_of(method);
        for (int n = orders.least; n <= orders.most; ++n) {
            std::string name(name_of(method));
            if (orders.most > 1) name += ' ' + std::to_string(n);
            methods.push_back({name, method, n});
        }
    }
    return methods;
}

}  // namespace squint
