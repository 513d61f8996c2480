#include "core/transfer_presets.h"

#include <algorithm>

namespace squint {
namespace {

struct Preset {
    std::string_view name;
    std::vector<ColorPoint> color;      // HU; linear light
    std::vector<OpacityPoint> opacity;  // of one millimetre
};

constexpr Vec3 kSkin(0.82, 0.46, 0.32), kFat(0.85, 0.62, 0.28), kFlesh(0.55, 0.11, 0.07),
    kBlood(0.66, 0.03, 0.02), kBone(0.90, 0.80, 0.62), kEnamel(1, 0.97, 0.90), kAir(0.10, 0.25, 0.55),
    kLung(0.75, 0.36, 0.28);

// On the Hounsfield scale air is -1000, lung -900 to -500, fat -120 to -60, water 0, muscle 30 to 70, blood
// with contrast 150 to 450, cancellous bone 200 to 700, cortical bone 700 to 2000, enamel above 2000.
const std::vector<Preset>& presets() {
    static const std::vector<Preset> list{
        // Bone alone, translucent at its spongy edge.
        {"ct_bone",
         {{150, kFlesh}, {350, kBone}, {1500, kBone}, {2200, kEnamel}},
         {{150, 0}, {300, 0.08}, {700, 0.45}, {1500, 0.85}}},
        // The surface of bone, opaque: shows fractures.
        {"ct_bone_surface", {{250, kBone}, {1500, kBone}, {2200, kEnamel}}, {{250, 0}, {300, 1}}},
        // The surface of the body: a thin rise from air, then dense.
        {"ct_skin", {{-500, kSkin}, {50, kSkin}, {300, kBone}}, {{-450, 0}, {-250, 0.5}, {-150, 0.9}}},
        // Skin as a veil over bone.
        {"ct_skin_and_bone",
         {{-400, kSkin}, {100, kSkin}, {250, kBone}, {2200, kEnamel}},
         {{-400, 0}, {-250, 0.03}, {-150, 0.01}, {150, 0.01}, {300, 0.3}, {1000, 0.9}}},
        // Muscle and organs; fat is faint, bone shines through.
        {"ct_muscle",
         {{-150, kFat}, {-30, kFat}, {20, kFlesh}, {120, kFlesh}, {300, kBone}, {2000, kEnamel}},
         {{-150, 0}, {-60, 0.01}, {10, 0.03}, {50, 0.35}, {120, 0.35}, {250, 0.3}, {700, 0.8}}},
        // Airways and the tissue of the lung; the body around it stays clear.
        {"ct_lung",
         {{-1000, kAir}, {-900, kAir}, {-750, kLung}, {-400, kLung}},
         {{-1000, 0}, {-950, 0.004}, {-850, 0.015}, {-650, 0.08}, {-500, 0.12}, {-350, 0}}},
        // Vessels filled with contrast medium, before faint bone.
        {"ct_vessels",
         {{100, kFlesh}, {160, kBlood}, {400, kBlood}, {550, kBone}, {2000, kEnamel}},
         {{110, 0}, {170, 0.25}, {300, 0.7}, {420, 0.7}, {550, 0.15}, {1500, 0.25}}},
        // All tissues at once, for a first look.
        {"ct_overview",
         {{-600, kLung},
          {-150, kFat},
          {-40, kFat},
          {30, kFlesh},
          {120, kFlesh},
          {250, kBone},
          {2000, kEnamel}},
         {{-700, 0}, {-400, 0.004}, {-100, 0.006}, {40, 0.03}, {150, 0.04}, {300, 0.3}, {1000, 0.8}}},
    };
    return list;
}

}  // namespace

std::vector<std::string> transfer_preset_names() {
    std::vector<std::string> names;
    for (const Preset& preset : presets()) names.emplace_back(preset.name);
    return names;
}

bool find_transfer_preset(std::string_view name, TransferFunction& function) {
    const auto found =
        std::find_if(presets().begin(), presets().end(), [&](const Preset& p) { return p.name == name; });
    if (found == presets().end()) return false;
    function = {};
    function.color = found->color, function.opacity = found->opacity;
    function.name = found->name;
    return true;
}

}  // namespace squint
