// Scenes whose kernels are checked alone: plans that choose among all of them.
#pragma once

#include "pipeline/machines/lanes/cell_blocks.h"
#include "pipeline/machines/lanes/kernels.h"
#include "scene/scene.h"
#include "tests/plan_of.h"

#include <fmt/format.h>

#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace squint::lanes {

/// A plan, its words, and where its voxels are fetched from.
struct KernelCase {
    std::string name;
    Plan plan;
    StageWays ways;
    std::shared_ptr<CellBlocks> cells;  // none: the volume as it lies
    VoxelSource source;
    std::shared_ptr<LitCells> lit = nullptr;
};

inline KernelCase kernel_case(const std::string& name, std::vector<std::string> settings, bool in_cells) {
    for (const char* common :
         {"classification.method=pc", "volume.dims=[26, 23, 21]", "image.width=24", "image.height=24"})
        settings.insert(settings.begin(), common);
    const Scene scene = scene_with(built_in_scene(), settings);
    const auto volume = test::volume_of(scene);
    KernelCase c{name + (in_cells ? ", cells" : ", linear"), make_plan(scene, volume), {}, nullptr, {}};
    c.ways = ways_of(c.plan);
    c.source.volume = c.plan.volume.get();
    if (in_cells) {
        c.cells = cell_blocks(*volume, CellBlocks::bytes_of_all(*volume), true);
        c.cells->build([](std::int64_t block) { return block % 3 != 0; });  // some cells are put together
        c.source.cells = c.cells->data(), c.source.blocks = c.cells->blocks();
        c.source.slots = c.cells->slots();
        c.source.near = c.cells->near();
    }
    return c;
}

/// The same with lit cells in half of the volume.
inline KernelCase with_lit_cells(KernelCase c) {
    c.name += " and lit cells";
    const Volume& volume = *c.plan.volume;
    constexpr auto kContent = CellContent::differences;
    BlockBox half = all_blocks_of(volume);
    half.blocks.z = (half.blocks.z + 1) / 2;
    c.lit = std::make_shared<LitCells>(
        half, nullptr,
        std::make_shared<CellBlocks>(volume, CellBlocks::bytes_of_all(volume, kContent), kContent));
    c.lit->build();
    c.source.lit = c.lit.get();
    return c;
}

inline std::vector<KernelCase> kernel_cases() {
    const std::string lit = "shading.model=blinn_phong", unlit = "shading.model=none";
    const auto method = [](const char* name) { return std::string("classification.method=") + name; };
    std::vector<KernelCase> cases;
    for (const bool in_cells : {true, false}) {
        const auto add = [&](const std::string& name, std::vector<std::string> settings) {
            cases.push_back(kernel_case(name, std::move(settings), in_cells));
        };
        add("default", {unlit});
        add("default, from 0 to 1 at once",
            {unlit,
             "transfer_function.points=[[0, 0, 0, 1, 0.1], [900, 0, 0, 1, 0.1], [901, 1, 0, 0, 0.1]]"});
        for (const auto& [name, more] :
             {std::pair{"default, lit", std::vector<std::string>{}},
              {"default, lit, 8 bits, uneven voxels", {"volume.bits=8", "volume.spacing=[1, 0.7, 1.6]"}}}) {
            std::vector<std::string> settings{lit};
            settings.insert(settings.end(), more.begin(), more.end());
            add(name, settings);
            cases.push_back(with_lit_cells(kernel_case(name, settings, in_cells)));
        }
        add("16 bits, sobel, perspective",
            {lit, "volume.bits=16", "shading.gradient=sobel", "camera.projection=perspective"});
        add("pips, analytic, phong, two-sided", {lit, method("pips"), "shading.gradient=analytic",
                                                 "shading.model=phong", "shading.two_sided=true"});
        for (const char* rule : {"linear", "nlpi", "centroid", "two_point"})
            for (const char* name : {"pi2d", "pips", "leg"})
                add(fmt::format("{}, {}", name, rule),
                    {lit, method(name), "classification.table_size=64", std::string("shading.inside=") + rule,
                     "classification.order=" + std::string(name == std::string_view("leg") ? "3" : "1")});
        add("pi2d, back to front",
            {unlit, method("pi2d"), "classification.table_size=64", "compositing.form=back_to_front"});
        for (const char* name : {"pc", "pips", "pi2d", "pi1d"}) {
            add(std::string(name) + ", unlit", {unlit, method(name), "classification.table_size=64"});
            add(std::string(name) + ", fine steps",
                {unlit, method(name), "classification.table_size=64", "sampling.step=0.2"});
        }
        add("pi1d, opacities", {lit, method("pi1d"), "compositing.form=alpha", "sampling.step=0.6"});
        add("squeeze", {unlit, method("pc_mid"), "precision.preset=squeeze"});
        add("eight bits", {lit, "precision.preset=eight_bit"});
        add("wide", {lit, "precision.preset=wide"});
    }
    return cases;
}

}  // namespace squint::lanes
