// PC, post-classification: the sample's own matter over the slab's length (Squeeze, section 3).  No
// integration, no table but the entries themselves: alpha = 1 - exp(-tau(s) d), C = c(s) alpha.
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
