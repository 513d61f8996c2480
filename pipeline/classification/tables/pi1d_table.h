// PI1D: one-dimensional tables for slabs of one length, without self-attenuation inside the slab.
//
//   kye     a_i = 1 - exp(-tau_i d);   alpha = mean of a_i,    C = mean of a_i c_i       (Kye et al. 2008)
//   engel   v_i = min(tau_i d, 1);     x = mean of v_i,   alpha = 1 - exp(-x),   C = mean of v_i c_i <= alpha
//           (Engel 2003, as described by Lee & Shin, section 3.3)
//
// kye takes the arithmetic mean of opacity in place of the geometric mean of
// transparency: a wall one entry thin among n gives 1/n.  Means run over the linear
// interpolant of the entries' values.  A slab inside one point has that point's
// value.
#pragma once

#include "pipeline/classification/tables/opaque_prediction.h"

namespace squint::preintegration {

enum class MeanOf { opacity_kye, clamped_extinction_engel };

struct RealPreIntegrated1D {
    MeanOf mean = MeanOf::opacity_kye;
    double length = 1;            // world units: the tables are for slabs of this length
    std::vector<double> value{};  // a_i or min(tau_i d, 1)
    Channels colored{};           // value_i c_i
    std::vector<double> sum{};    // prefix integral of value over the coordinate: sum[0] = 0, trapezoids
    Channels colored_sum{};

    /// A slab of another length keeps its colour and takes alpha' = 1 - (1 - alpha)^(slab_length / length).
    SlabValue slab(double front, double back, double slab_length) const;
};

/// Opaque entries count as a_i = 1 (Kye) or tau_i d = 1 (Engel): these methods lose thin walls unless a
/// prediction cuts the slab.
RealPreIntegrated1D build_pi1d(const Entries& entries, double length, MeanOf mean);

/// The same matter over `ratio` times the length it was integrated for; what is opaque stays so.
SlabValue with_length_ratio(const SlabValue& slab, double ratio);

}  // namespace squint::preintegration
