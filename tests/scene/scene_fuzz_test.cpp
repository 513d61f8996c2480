// Damaged scenes are read or refused in one line; nothing else happens.
#include "core/error.h"
#include "scene/scene.h"

#include <gtest/gtest.h>

#include <random>
#include <string>

namespace squint {
namespace {

constexpr std::string_view kPieces[] = {"[",      "]",
                                        "[[",     "{",
                                        "}",      "=",
                                        "\"",     "'",
                                        "\"\"\"", "'''",
                                        "\\",     "\\u",
                                        "#",      ".",
                                        ",",      "\n",
                                        "\r\n",   "&",
                                        "nan",    "-inf",
                                        "1e999",  "9999999999999999999",
                                        "0x",     "1979-05-27T07:32:00Z",
                                        "[&",     "lights",
                                        "auto",   "points",
                                        "= [",    "\t",
                                        "\x01",   "\xff",
                                        "true",   "-0.0"};

/// One to four small changes: a byte changed, a stretch dropped, moved or doubled, or a piece of TOML put in.
std::string damaged(std::string text, std::mt19937& random) {
    const auto below = [&](std::size_t n) { return n == 0 ? 0 : random() % n; };
    for (std::size_t changes = 1 + below(4); changes > 0 && !text.empty(); --changes) {
        const std::size_t at = below(text.size());
        const std::string stretch = text.substr(at, 1 + below(40));
        switch (below(5)) {
            case 0:
                text[at] = static_cast<char>(below(256));
                break;
            case 1:
                text.erase(at, stretch.size());
                break;
            case 2:
                text.insert(below(text.size()), stretch);
                break;
            case 3:
                text.insert(at, kPieces[below(std::size(kPieces))]);
                break;
            case 4:
                text.replace(at, stretch.size(), kPieces[below(std::size(kPieces))]);
                break;
        }
    }
    return text;
}

template <class F>
void read_or_refuse_in_one_line(F&& read, unsigned seed, const std::string& text) {
    try {
        read();
    } catch (const InputError& error) {
        const std::string line = error.what();
        ASSERT_EQ(line.find_first_of("\r\n"), std::string::npos) << "seed " << seed << ": " << line;
        ASSERT_FALSE(line.empty());
    } catch (const std::exception& error) {
        FAIL() << "seed " << seed << ": " << error.what() << '\n' << text;
    }
}

TEST(SceneFuzz, DamagedFilesAreReadOrRefused) {
    Scene scene = built_in_scene();
    scene.precision.override_[0] = "u11.12 trn";
    const std::string valid = to_toml(scene);
    for (unsigned seed = 0; seed < 4000; ++seed) {
        std::mt19937 random(seed);
        const std::string text = damaged(valid, random);
        read_or_refuse_in_one_line([&] { to_toml(parse_scene(text, "s.toml", "")); }, seed, text);
    }
}

TEST(SceneFuzz, DamagedOverridesAreReadOrRefused) {
    const auto record = resolved(built_in_scene());
    for (unsigned seed = 0; seed < 4000; ++seed) {
        std::mt19937 random(seed);
        const auto& [key, value] = record[random() % record.size()];
        const std::string text = damaged(key + '=' + value, random);
        read_or_refuse_in_one_line([&] { to_toml(scene_with(built_in_scene(), {text})); }, seed, text);
    }
}

}  // namespace
}  // namespace squint
