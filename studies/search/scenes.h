// The scenes of a search, plans of them, and what they have in common.
#pragma once

#include "pipeline/plan/plan.h"
#include "studies/sweep/evaluate.h"

#include <atomic>
#include <cstddef>
#include <set>
#include <string>
#include <vector>

namespace squint::search {

class Scenes {
  public:
    /// Those of `sweep`; `folder` is sweep::Evaluator's.
    Scenes(const sweep::SweepFile& sweep, std::string folder, const std::atomic<bool>* cancelled);

    std::size_t count() const;
    std::string name(std::size_t scene) const;
    sweep::Evaluator& evaluator() { return evaluator_; }

    /// Scenes as a point has them.  Throws InputError where there is no plan of it.
    sweep::Prepared prepared(const sweep::Point& point);
    Plan plan(const sweep::Point& point);
    Plan plan(std::size_t scene, const std::vector<std::string>& overrides);

    /// Throws InputError unless both scenes have one preset.
    void check_preset(std::size_t scene, const Plan& plan, const std::string& of_first) const;
    /// The wires that were asked for, or all used ones.  Throws InputError where one is not used.
    std::vector<Wire> chosen(const std::vector<Wire>& asked, const std::set<Wire>& used) const;

  private:
    const sweep::SweepFile& sweep_;
    sweep::Evaluator evaluator_;
};

/// Overrides that leave no format but the preset's.
std::vector<std::string> preset_alone(std::string_view preset);

}  // namespace squint::search
