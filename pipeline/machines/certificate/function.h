// The transfer function over an interval of inputs, as no word has it.
#pragma once

#include "core/portable_math.h"
#include "pipeline/plan/plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace squint {

struct Reach {
    double low = 0, high = 0;
    void take(double x) { low = std::min(low, x), high = std::max(high, x); }
    /// How far anything in it is from a point in it.
    double from(double x) const { return std::max(high - x, x - low); }
};

/// The length of a full slab that the method's tables are built for: one scalar stands for a projection's ray, with its
/// opacity as declared.
inline double full_step(const Plan& plan) {
    return plan.projection_mode ? plan.entries.unit_distance : plan.step_world;
}
/// Of an optical depth.
inline double opacity_of(double depth) {
    return -portable::expm1(-depth);
}
/// The function as no word has it: extinction of a full step and colour, linear between entries; opaque entries.
class Function {
  public:
    explicit Function(const Plan& plan) {
        for (const Entry& entry : plan.entries.entry) {
            curve_[3].push_back(entry.extinction * full_step(plan));
            for (int c = 0; c < 3; ++c) curve_[static_cast<std::size_t>(c)].push_back(entry.color[c]);
            opaque_.push_back(entry.opaque);
            has_opaque_ = has_opaque_ || entry.opaque;
        }
    }
    enum Curve : std::size_t { red, green, blue, depth };
    /// Of pi1d: what its means are of.  `depth` is an entry's opacity (Kye), or its depth up to 1 (Engel), `red` to
    /// `blue` that times the colour; an opaque entry counts 1.
    static Function of_means(const Plan& plan, bool is_opacity) {
        Function f(plan);
        for (std::size_t i = 0; i < f.opaque_.size(); ++i) {
            double& value = f.curve_[depth][i];
            value = f.opaque_[i] ? 1 : is_opacity ? opacity_of(value) : std::min(value, 1.0);
            for (std::size_t c = 0; c < 3; ++c) f.curve_[c][i] *= value;
        }
        return f;
    }
    int last() const { return static_cast<int>(opaque_.size()) - 1; }

    double at(std::size_t curve, double input) const {
        const std::vector<double>& value = curve_[curve];
        const int i = std::clamp(static_cast<int>(input), 0, std::max(last() - 1, 0));
        if (last() == 0) return value[0];
        const auto n = static_cast<std::size_t>(i);
        return value[n] + (input - i) * (value[n + 1] - value[n]);
    }
    /// Of a curve over [low, high].
    Reach over(std::size_t curve, double low, double high) const {
        const double first = at(curve, low);
        Reach all{first, first};
        all.take(at(curve, high));
        for (int i = static_cast<int>(low) + 1; i < high; ++i)
            all.take(curve_[curve][static_cast<std::size_t>(i)]);
        return all;
    }
    /// The mean of a curve between two inputs.
    double mean(std::size_t curve, double from, double to) const {
        const double low = std::min(from, to), high = std::max(from, to);
        if (!(low < high)) return at(curve, low);
        double sum = 0, here = low;
        while (here < high) {
            const double next = std::min(std::floor(here) + 1, high);
            sum += (next - here) * (at(curve, here) + at(curve, next)) / 2, here = next;
        }
        return sum / (high - low);
    }
    /// The steepest segment of a curve over [low, high], per entry.
    double slope(std::size_t curve, double low, double high) const {
        double most = 0;
        const int first = std::clamp(static_cast<int>(low), 0, std::max(last() - 1, 0));
        for (int i = first; i < last() && (i == first || i < high); ++i)
            most = std::max(most, std::abs(curve_[curve][static_cast<std::size_t>(i) + 1] -
                                           curve_[curve][static_cast<std::size_t>(i)]));
        return most;
    }
    /// Whether anything, and everything, in [low, high] is opaque: entries, and what lies between two.
    struct Opaque {
        bool any = false, all = false;
    };
    Opaque opaque(double low, double high) const {
        if (!has_opaque_) return {};
        Opaque found{false, true};
        const int from = static_cast<int>(std::floor(low)), to = static_cast<int>(std::ceil(high));
        for (int i = from; i <= std::min(to, last()); ++i) {
            const bool here = opaque_[static_cast<std::size_t>(i)];
            found.all = found.all && here;
            found.any = found.any || (here && low <= i && i <= high);
        }
        found.any = found.any || found.all;
        return found;
    }

  private:
    std::array<std::vector<double>, 4> curve_;
    std::vector<bool> opaque_;
    bool has_opaque_ = false;
};

}  // namespace squint
