// What a search by pictures varies: the bits of every wire.
#pragma once

#include "studies/search/scenes.h"
#include "studies/search/word_lengths.h"

#include <map>
#include <string>
#include <utility>
#include <vector>

namespace squint::search {

/// Fraction bits of every wire, then, where asked for, integer bits of every wire.  One format serves all scenes.
class Variables {
  public:
    /// Of `asked`, or of all wires in use.  Throws InputError where scenes cannot share formats.
    Variables(Scenes& scenes, const std::vector<Wire>& asked, bool integer_bits);

    const std::string& preset() const { return preset_; }
    const std::vector<Wire>& wires() const { return wires_; }
    /// Of every wire as the scenes have it, with the integer bits of the scene that needs most.
    const std::vector<Spec>& base() const { return base_; }
    bool uses(std::size_t scene, Wire wire) const;

    /// Of wire w under these lengths.
    Spec spec(const Lengths& lengths, std::size_t w) const;
    std::vector<sweep::WireEdit> edits(const Lengths& lengths) const;
    /// The most that `wide` has, or the scenes' own.
    Lengths most(bool wide) const;
    /// Axis and label of a point that differs from others in one variable.
    std::pair<std::string, std::string> label(int variable, const Lengths& lengths) const;

  private:
    void add(Wire wire, Scenes& scenes, const std::vector<Plan>& plans);

    bool integer_bits_;
    std::string preset_;
    std::vector<Wire> wires_;
    std::vector<Spec> base_;                          // of wires_
    std::vector<int> most_fraction_;                  // of wires_
    std::map<Wire, std::vector<std::size_t>> users_;  // scenes that use each wire
    std::map<std::size_t, WireSpecs> wide_;           // by scene
};

}  // namespace squint::search
