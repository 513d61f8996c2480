// PC, post-classification: the matter of one sample over the slab's length (Squeeze, section 3), with no
// integration and no table but the entries: alpha = 1 - exp(-tau(s) d), C = c(s) alpha.
#pragma once

#include "pipeline/classification/tables/linear_entries.h"

namespace squint::preintegration {

enum class Sample { front, middle };

struct RealPostClassification {
    Entries entries;
    Sample sample = Sample::front;

    SlabValue slab(double front, double back, double length) const {
        return point_slab(entries, sample == Sample::front ? front : (front + back) / 2, length);
    }
};

}  // namespace squint::preintegration
