// Bounds a pixel from the slabs of its ray: the sum of certificate.h, from the back to the front.
#pragma once

#include "pipeline/machines/certificate/function.h"
#include "pipeline/machines/certificate/payers.h"
#include "pipeline/plan/plan.h"
#include "pipeline/slab.h"

#include <array>
#include <initializer_list>
#include <utility>
#include <vector>

namespace squint {

/// Hears every slab of a ray, then bounds its pixel.
class BoundedRay : public Silent {
  public:
    /// `known`: of what compositing rounds what it took, not what it may take.
    BoundedRay(const Plan& plan, bool known);

    void begin() { slabs_.clear(); }
    void composited(const Slab<Bounded>& slab, const Accumulated<Bounded>& before,
                    const Accumulated<Bounded>& after);

    /// Shares of R, G, B and A, of 1.0.  `stopped`: the ray ended before its last slab.
    std::array<Shares, 4> bound(bool stopped);
    /// What no bound need pass: the pixel without rounding lies in [0, brightest].
    static void limit(std::array<Shares, 4>& all, const std::array<double, 4>& words, double brightest);
    double brightest() const { return brightest_; }

  private:
    struct Color {
        double value = 0, before = 0, after = 0;
        Shares error;
    };
    struct Seen {
        Shares alpha_error;
        double alpha = 0, clear_before = 1, clear_after = 1;
        std::array<Color, 3> color;
        double alpha_off = 0, clear_off = 0;  // clear_off: of T behind the slab
    };

    Shares within_light(const Shares& error, double value) const;
    double clear(const Accumulated<Bounded>& pixel) const;
    static Reach opacities(const Seen& k);
    Reach colors(const Seen& k, std::size_t c) const;
    Reach gathered(const Seen& k, std::size_t c, const Reach& behind) const;
    bool is_premultiplied(std::size_t c) const;
    bool carries() const;
    double add_step(Shares& shares, const Seen& k, std::size_t c, const Reach& behind, double apart) const;
    void from_the_back(std::array<Shares, 4>& all, bool stopped);
    void from_the_front(std::array<Shares, 4>& all);

    void add_step_shares(Shares& shares, double known,
                         std::initializer_list<std::pair<int, double>> usual) const;

    const CompositingStage& s_;
    bool known_;
    double alpha_unit_ = 1, color_unit_ = 1, brightest_ = 0;
    std::vector<Seen> slabs_;
};

}  // namespace squint
