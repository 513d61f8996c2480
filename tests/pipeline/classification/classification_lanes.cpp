// Lanes of the build's own SIMD target, for classification_test.cpp.
#include "fixedpoint/words/lane_quotients-inl.h"
#include "fixedpoint/words/lane_tables-inl.h"
#include "pipeline/classification/methods-inl.h"

#include <array>
#include <vector>

namespace squint::cases {
namespace {

using Row = std::vector<std::int32_t>;

template <class L>
std::array<Row, 4> classify_rows(const ClassificationMethod& method, const Row& front, const Row& back,
                                 const Row& length) {
    using namespace HWY_NAMESPACE;
    std::array<Row, 4> out;
    for (Row& row : out) row.resize(front.size());
    std::visit(
        [&](const auto& m) {
            for (std::size_t at = 0; at < front.size(); at += L::count()) {
                const Slab<L> slab =
                    classify(m, load<L>(&front[at]), load<L>(&back[at]), load<L>(&length[at]));
                for (std::size_t c = 0; c < 3; ++c) store(slab.color[c], &out[c][at]);
                store(slab.alpha, &out[3][at]);
            }
        },
        method);
    return out;
}

}  // namespace

std::array<Row, 4> classify_in_lanes(const ClassificationMethod& method, int bits, const Row& front,
                                     const Row& back, const Row& length) {
    return bits == 32 ? classify_rows<HWY_NAMESPACE::Lanes<std::int32_t>>(method, front, back, length)
                      : classify_rows<HWY_NAMESPACE::Lanes<std::int64_t>>(method, front, back, length);
}

}  // namespace squint::cases
