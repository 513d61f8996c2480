#include "pipeline/machines/lanes/lit_cells.h"

#include "pipeline/kept.h"
#include "pipeline/machines/lanes/blocks_met.h"

#include <algorithm>

namespace squint::lanes {
namespace {

// Building a cell takes the time that 2 gradients save where its pages have been used before, 25 where they are new to a
// virtual machine (decision 0094).
constexpr std::int64_t kGradientsPerCell = 16;

}  // namespace

LitCells::LitCells(const BlockBox& box, std::shared_ptr<const EmptySpace> empty,
                   std::shared_ptr<CellBlocks> cells)
    : box_(box), empty_(std::move(empty)), cells_(std::move(cells)) {
    const std::vector<std::int32_t> slots = cells_->slots();
    std::int64_t missing = 0;
    for (std::size_t i = 0; i < slots.size(); ++i)
        if (wants(static_cast<std::int64_t>(i))) ++wanted_, missing += slots[i] < 0;
    enough_ = missing * CellBlocks::kCells * kGradientsPerCell;
    if (missing == 0) build();
}

bool LitCells::wants(std::int64_t block) const {
    return may_be_met(box_, empty_.get(), cells_->blocks(), block, 0);
}

void LitCells::add(std::int64_t gradients) {
    if (built()) return;
    if ((taken_ += gradients) >= enough_) build();
}

void LitCells::build() {
    if (claimed_.exchange(true)) return;
    cells_->build([this](std::int64_t block) { return wants(block); });
    made_ = {cells_->data(), cells_->blocks(), cells_->slots()};
    built_.store(&made_, std::memory_order_release);
}

std::int64_t LitCells::to_come() const {
    return built() ? 0 : std::max<std::int64_t>(enough_ - taken_, 0);
}

std::int64_t LitCells::bytes() const {
    return cells_->bytes() +
           static_cast<std::int64_t>(built() ? made_.slots.size() * sizeof(made_.slots[0]) : 0);
}

bool LitCells::are_of(const BlockBox& box, const EmptySpace* empty, const CellBlocks* cells) const {
    return cells_.get() == cells && empty_.get() == empty && box_.low == box.low && box_.blocks == box.blocks;
}

std::shared_ptr<LitCells> lit_cells(const Volume& volume, const BlockBox& box,
                                    const std::shared_ptr<const EmptySpace>& empty,
                                    const std::shared_ptr<CellBlocks>& cells) {
    static KeptPerVolume<LitCells> kept;
    return kept.find_or_make(
        volume, [&] { return std::make_shared<LitCells>(box, empty, cells); },
        [&](const LitCells& lit) { return lit.are_of(box, empty.get(), cells.get()); });
}

}  // namespace squint::lanes
