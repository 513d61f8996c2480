// Rules for light inside a slab (shading.inside) as whole pictures: where they must agree, what bounds them, and
// which are refused.
#include "core/error.h"
#include "core/procedural.h"
#include "pipeline/record.h"
#include "pipeline/render.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

namespace squint {
namespace {

using Settings = std::vector<std::string>;

constexpr const char* kMethods[] = {"pi2d", "pi1d", "pips", "leg"};

Plan plan_with(const std::string& method, const std::string& rule, const Settings& more,
               const ProceduralField* field = nullptr) {
    Settings settings{"volume.dims=33",
                      "image.width=24",
                      "image.height=24",
                      "transfer_function.points=[[0,1,1,1,0],[4095,1,1,1,0.4]]",
                      "transfer_function.entries=64",
                      "sampling.termination=0",
                      "camera.projection=orthographic",
                      "shading.model=blinn_phong",
                      "classification.table_size=64",
                      "classification.method=" + method,
                      "classification.order=" + std::string(method == "leg" ? "2" : "1")};
    if (!rule.empty()) settings.push_back("shading.inside=" + rule);
    settings.insert(settings.end(), more.begin(), more.end());
    const Scene scene = scene_with(built_in_scene(), settings);
    return make_plan(scene, std::make_shared<Volume>(field ? make_procedural(*field, {33, 33, 33}, 12)
                                                           : load_volume(volume_source(scene))));
}
Image picture_of(const Plan& plan) {
    RenderOptions model;
    model.path = Path::model;
    return render(plan, model).image;
}

/// The rules that a method has.
std::vector<std::string> rules_of(const std::string& method) {
    std::vector<std::string> rules;
    for (const std::string_view rule : EnumNames<InsideRule>::names) try {
            plan_with(method, std::string(rule), {});
            rules.emplace_back(rule);
        } catch (const InputError&) {
        }
    return rules;
}
template <class F>
void for_every_rule(F&& f) {
    int met = 0;
    for (const char* method : kMethods)
        for (const std::string& rule : rules_of(method)) {
            SCOPED_TRACE(std::string(method) + ", " + rule);
            f(method, rule);
            ++met;
        }
    EXPECT_GE(
        met,
        28);  // mean, front, middle, centroid, two_point of four, linear and nlpi of three, adaptive of two
}

double largest_difference(const Image& a, const Image& b, bool mirrored = false) {
    double largest = 0;
    for (const char* name : {"R", "G", "B"})
        for (int y = 0; y < a.height; ++y)
            for (int x = 0; x < a.width; ++x) {
                const auto at = [&](const Image& image, int column) {
                    const std::size_t pixel =
                        static_cast<std::size_t>(y) * static_cast<std::size_t>(a.width) +
                        static_cast<std::size_t>(column);
                    return double{image.find(name)->values[pixel]};
                };
                largest = std::max(largest, std::abs(at(a, x) - at(b, mirrored ? a.width - 1 - x : x)));
            }
    return largest;
}

// The gradient of a ramp has one direction everywhere, faces of the volume included.
TEST(InsideRules, AgreeWhereTheNormalDoesNotTurn) {
    for_every_rule([](const std::string& method, const std::string& rule) {
        const Settings real{"volume.procedural=ramp", "precision.preset=real"};
        // Pixels are floats, and doubles' roundings are far below theirs.
        EXPECT_LE(largest_difference(picture_of(plan_with(method, rule, real)),
                                     picture_of(plan_with(method, "mean", real))),
                  0x1p-23);
    });
    const Settings rounded{"volume.procedural=ramp"};
    for (const char* method : {"pips", "leg"})
        EXPECT_EQ(largest_difference(picture_of(plan_with(method, "adaptive", rounded)),
                                     picture_of(plan_with(method, "mean", rounded))),
                  0)
            << "one piece has the bits of mean";
    for_every_rule([&](const std::string& method, const std::string& rule) {
        // In each of 33 slabs: a last bit of the normal in N.L and in N.H, and half of four parts or two places.
        EXPECT_LE(largest_difference(picture_of(plan_with(method, rule, rounded)),
                                     picture_of(plan_with(method, "mean", rounded))),
                  33 * 4 * 0x1p-15);
    });
}

// Colours that bring their opacity may have other fraction bits than opacities: a highlight is as bright.
TEST(InsideRules, LightColoursThatAreFinerOrCoarserThanOpacities) {
    for (const char* method : {"pi2d", "pi1d"})
        for (const char* color : {"u1.19 rnd", "u1.12 rnd"}) {
            const std::string format = std::string("precision.slab_color=") + color;
            EXPECT_LE(
                largest_difference(picture_of(plan_with(method, "mean", {"volume.procedural=ramp", format})),
                                   picture_of(plan_with(
                                       method, "mean", {"volume.procedural=ramp", "precision.preset=real"}))),
                4.0 / 255)
                << method << ' ' << color;
        }
}

TEST(InsideRules, AreTwoPlacesByDefault) {
    for (const char* method : kMethods)
        EXPECT_EQ(plan_with(method, "", {}).inside.rule, InsideRule::two_point) << method;
    EXPECT_EQ(plan_with("pc", "", {}).inside.rule, InsideRule::front);
}

// Zero gradients, at both ends and between: ambient light alone.
TEST(InsideRules, GiveEvenMatterAmbientLight) {
    for_every_rule([](const std::string& method, const std::string& rule) {
        const Image image =
            picture_of(plan_with(method, rule,
                                 {"volume.procedural=constant", "precision.preset=real", "shading.ka=0.25",
                                  "transfer_function.points=[[0,1,1,1,0.3],[4095,1,1,1,0.3]]"}));
        for (std::size_t i = 0; i < image.find("R")->values.size(); ++i)
            ASSERT_NEAR(image.find("R")->values[i], 0.25 * image.find("A")->values[i], 0x1p-22);
    });
}

TEST(InsideRules, KeepWhiteMattersLightWithinItsOpacity) {
    for_every_rule([](const std::string& method, const std::string& rule) {
        for (const char* field : {"marschner_lobb", "shells"})
            for (const char* model : {"phong", "blinn_phong", "cone"}) {
                const Image image = picture_of(plan_with(
                    method, rule,
                    {std::string("volume.procedural=") + field, std::string("shading.model=") + model,
                     "shading.ka=0.25", "shading.kd=0.5", "shading.ks=0.25", "shading.two_sided=true"}));
                double most = 0;
                for (const char* channel : {"R", "G", "B"})
                    for (std::size_t i = 0; i < image.find("A")->values.size(); ++i) {
                        // The last bit of a premultiplied slab's light may be one more than its opacity's.
                        ASSERT_LE(image.find(channel)->values[i], image.find("A")->values[i] + 33 * 0x1p-15);
                        most = std::max(most, double{image.find(channel)->values[i]});
                    }
                ASSERT_GT(most, 0.05) << field << ' ' << model;
            }
    });
}

TEST(InsideRules, LeaveTransparentMatterBlack) {
    for_every_rule([](const std::string& method, const std::string& rule) {
        const Image image = picture_of(plan_with(
            method, rule,
            {"volume.procedural=marschner_lobb", "transfer_function.points=[[0,1,1,1,0],[4095,1,1,1,0]]"}));
        for (const char* channel : {"R", "G", "B", "A"})
            for (const float value : image.find(channel)->values) ASSERT_EQ(value, 0);
    });
}

// Thin matter, lit from either side without highlights: what a ray gathers from in front it gathers from behind,
// but for what matter hides: (1 - e^-x) - x of it at most, x the ray's depth.
TEST(InsideRules, SeeThinMatterAlikeFromBothSides) {
    for_every_rule([](const std::string& method, const std::string& rule) {
        if (rule == "front") return;  // one end's alone
        const Settings thin{"volume.procedural=marschner_lobb",
                            "precision.preset=real",
                            "transfer_function.points=[[0,1,1,1,0.004],[4095,1,1,1,0.004]]",
                            "transfer_function.unit_distance=1",
                            "lights=[{direction=[0.3,0.5,0.7]}]",
                            "shading.two_sided=true",
                            "shading.ka=0",
                            "shading.kd=1",
                            "shading.ks=0",
                            "camera.elevation=0"};
        Settings front = thin, behind = thin;
        front.emplace_back("camera.azimuth=0"), behind.emplace_back("camera.azimuth=180");
        const Image from_front = picture_of(plan_with(method, rule, front)),
                    from_behind = picture_of(plan_with(method, rule, behind));
        const double depth = 32 * 0.00401;
        EXPECT_LE(largest_difference(from_front, from_behind, true), depth - -std::expm1(-depth));
        EXPECT_GT(*std::max_element(from_front.find("R")->values.begin(), from_front.find("R")->values.end()),
                  0.02);
    });
}

// A thin ridge between two samples turns the normal round: of slabs a voxel long, pieces find the light of slabs of
// a sixteenth, wherever the ridge stands.
TEST(InsideRules, PiecesFindTheLightOfAThinRidge) {
    double of_mean = 0, of_pieces = 0;
    for (double place = 16.05; place < 17; place += 0.1) {
        const ProceduralField ridge{"ridge",
                                    "",
                                    12,
                                    33,
                                    [=](const Vec3& p) {
                                        const double x = (p.x * 32 - place) / 2;
                                        return 1 / (1 + x * x);
                                    },
                                    [](const Vec3&) { return Vec3(); }};
        const auto light = [&](const char* rule, const char* step) {
            const Image image = picture_of(
                plan_with("pips", rule,
                          {"camera.azimuth=90", "camera.elevation=0", "precision.preset=real",
                           "lights=[{headlight=true}]", std::string("sampling.step=") + step,
                           "transfer_function.points=[[0,1,1,1,0],[2000,1,1,1,0],[3900,1,1,1,0.4]]"},
                          &ridge));
            return double{image.find("R")->values[static_cast<std::size_t>(12 * 24 + 12)]};
        };
        const double truth = light("mean", "0.0625");
        ASSERT_GT(truth, 0.1);
        of_mean += std::pow(light("mean", "1") - truth, 2);
        of_pieces += std::pow(light("adaptive", "1") - truth, 2);
    }
    EXPECT_LT(2 * std::sqrt(of_pieces), std::sqrt(of_mean));
}

TEST(InsideRules, AreRefusedWhereAMethodHasNoTablesForThem) {
    for (const char* method : {"pi2d", "pi1d"}) try {
            plan_with(method, "adaptive", {});
            ADD_FAILURE() << method;
        } catch (const InputError& error) {
            const std::string text = error.what();
            EXPECT_NE(text.find("shading.inside"), std::string::npos) << text;
            EXPECT_NE(text.find("\"adaptive\""), std::string::npos) << text;
            for (const char* allowed : {"middle", "pips", "leg"})
                EXPECT_NE(text.find(allowed), std::string::npos) << text;
            EXPECT_EQ(text.find('\n'), std::string::npos) << text;
        }
}

TEST(InsideRules, AreIgnoredWithANoteWhereASlabHasOneSample) {
    for (const char* method : {"pc", "pc_mid"})
        for (const std::string_view rule : EnumNames<InsideRule>::names) {
            const Plan plan = plan_with(method, std::string(rule), {"volume.procedural=sphere"});
            EXPECT_TRUE(std::any_of(plan.notes.begin(), plan.notes.end(),
                                    [](const std::string& note) {
                                        return note.find("shading.inside") != std::string::npos &&
                                               note.find("ignored") != std::string::npos;
                                    }))
                << method << ' ' << rule;
            EXPECT_EQ(largest_difference(picture_of(plan),
                                         picture_of(plan_with(method, "", {"volume.procedural=sphere"}))),
                      0);
        }
}

}  // namespace
}  // namespace squint
