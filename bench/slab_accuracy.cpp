// The accuracy of classification methods: each against the exact slab integral, errors of colour and alpha in
// LSB8 (1/255), in double, or with `--words PRESET` in a preset's words.  JSON on standard output;
// `--markdown` prints the tables of docs/measurements/slab-accuracy.md.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "core/error.h"
#include "pipeline/classification/tables/exact_slab.h"
#include "pipeline/classification/tables/legendre.h"
#include "pipeline/classification/tables/pi1d_table.h"
#include "pipeline/classification/tables/pi2d_table.h"
#include "pipeline/classification/tables/power_series.h"
#include "tests/pipeline/classification/classification_cases.h"
#include "truth/post_classification.h"

namespace {

using namespace squint;
using namespace squint::preintegration;

struct Function {
    std::string name;
    Entries entries;
};

Entries made(int size, const std::function<double(int)>& tau, const std::function<Vec3(int)>& color) {
    Entries entries;
    for (int i = 0; i < size; ++i) entries.entry.push_back({color(i), 0, tau(i), false});
    return entries;
}

std::vector<Function> functions(int size) {
    const auto s = [=](int i) { return static_cast<double>(i) / (size - 1); };
    const auto rainbow = [=](int i) { return Vec3(s(i), 1 - s(i), 1 - std::abs(2 * s(i) - 1)); };
    std::mt19937 generator(1);
    std::uniform_real_distribution<double> uniform(0, 1);
    const auto random_color = [&](int) {
        const double red = uniform(generator), green = uniform(generator);
        return Vec3(red, green, uniform(generator));
    };
    const auto log_uniform = [&](double low, double high) {
        return low * std::pow(high / low, uniform(generator));
    };
    const auto trapezoid = [=](int i) {
        return 0.8 * std::clamp(std::min((s(i) - 0.3) / 0.02, (0.6 - s(i)) / 0.02), 0.0, 1.0);
    };
    const auto step = [=](int i) {
        return s(i) < 0.45 ? Vec3(1, 0.2, 0)
               : s(i) < 0.47
                   ? Vec3(1, 0.2, 0) * ((0.47 - s(i)) / 0.02) + Vec3(0, 0.4, 1) * ((s(i) - 0.45) / 0.02)
                   : Vec3(0, 0.4, 1);
    };
    const auto near_peak = [=](int i) { return i == size / 2 ? Vec3(1, 1, 1) : Vec3(0.2, 0.4, 0.6); };
    return {
        {"ramp", made(size, s, rainbow)},
        {"trap", made(size, trapezoid, step)},
        {"peak1", made(
                      size, [=](int i) { return i == size / 2 ? 50 : 0.02; }, near_peak)},
        {"dirac", made(
                      size, [=](int i) { return i == size / 2 ? 1000 : 0.02; }, near_peak)},
        {"multi", made(
                      size, [=](int i) { return i % (size / 5) == size / 10 ? 1000 : 0.02; }, rainbow)},
        {"hf", made(
                   size, [&](int) { return log_uniform(1e-3, 2); }, random_color)},
        {"fog8", made(
                     size, [](int) { return -std::log1p(-1.0 / 256); }, rainbow)},
        {"fog15", made(
                      size, [](int) { return -std::log1p(-1.0 / 32768); }, rainbow)},
        {"dense", made(
                      size, [](int) { return 20.0; }, rainbow)},
        {"densehf", made(
                        size, [&](int) { return 2 + 18 * uniform(generator); }, random_color)},
    };
}

struct DrawnSlab {
    double front, back, length;
};

/// Ends on entries; lengths 1/4, 1/2, 1 and 2 in turn.
std::vector<DrawnSlab> drawn(int size, double reach, int count) {
    std::mt19937 generator(2);
    std::uniform_real_distribution<double> uniform(0, 1);
    std::vector<DrawnSlab> slabs;
    while (static_cast<int>(slabs.size()) < count) {
        const double front = std::round(uniform(generator) * (size - 1));
        const double back = std::round(front + (2 * uniform(generator) - 1) * reach * size);
        if (back >= 0 && back <= size - 1 && back != front)
            slabs.push_back({front, back, 0.25 * (1 << (slabs.size() % 4))});
    }
    return slabs;
}

using SlabFunction = std::function<SlabValue(const DrawnSlab&)>;

SlabValue without_self_attenuation(const PrefixTables& tables, const DrawnSlab& slab) {
    const Moments moments = tables.moments(slab.front, slab.back, slab.length, 1);
    SlabValue value{moments.q[0], -std::expm1(-moments.depth)};
    for (int k = 0; k < 3; ++k) value.color[k] = std::min(value.color[k], 1.0);
    return value;
}

/// A method with tables for one length: a set for each of the four lengths.
template <class Build>
SlabFunction for_each_length(const Build& build) {
    using Tables = decltype(build(1.0));
    auto tables = std::make_shared<std::vector<Tables>>();
    for (int i = 0; i < 4; ++i) tables->push_back(build(0.25 * (1 << i)));
    return [=](const DrawnSlab& slab) {
        const int which = slab.length < 0.4 ? 0 : slab.length < 0.8 ? 1 : slab.length < 1.5 ? 2 : 3;
        return (*tables)[which].slab(slab.front, slab.back, slab.length);
    };
}

std::vector<std::pair<std::string, SlabFunction>> methods(const Entries& entries) {
    std::vector<std::pair<std::string, SlabFunction>> list;
    const auto add = [&](const std::string& name, auto method) {
        list.emplace_back(name, [=](const DrawnSlab& s) { return method.slab(s.front, s.back, s.length); });
    };
    add("PC", preintegration::RealPostClassification{entries, Sample::front});
    add("PC middle", preintegration::RealPostClassification{entries, Sample::middle});
    list.emplace_back("PI1D Kye",
                      for_each_length([&](double d) { return build_pi1d(entries, d, MeanOf::opacity_kye); }));
    list.emplace_back("PI1D Engel", for_each_length([&](double d) {
                          return build_pi1d(entries, d, MeanOf::clamped_extinction_engel);
                      }));
    list.emplace_back("no self-attenuation", [tables = build_prefix_tables(entries, 1)](const DrawnSlab& s) {
        return without_self_attenuation(tables, s);
    });
    for (const int order : {1, 2, 3, 4, 5})
        add("PIPS(" + std::to_string(order) + ")", build_power_series(entries, order));
    for (const int order : {2, 3, 4})
        add("LEG(" + std::to_string(order) + ")", build_legendre_series(entries, order, 2));
    for (const int size : {256, 1024})
        if (size <= entries.size())
            list.emplace_back("PI2D " + std::to_string(size),
                              for_each_length([&](double d) { return build_pi2d(entries, size, d); }));
    return list;
}

/// The same in fixed point: a preset's tables and words, built for each of the four lengths.  Cases that a
/// method refuses are left out.
std::vector<std::pair<std::string, SlabFunction>> methods_in_words(const Entries& entries,
                                                                   const std::string& preset) {
    std::vector<std::pair<std::string, SlabFunction>> list;
    for (const cases::MethodCase& which : cases::all_methods()) {
        const bool table =
            which.method == squint::Method::pi2d || which.method == squint::Method::pi2d_no_attenuation;
        const int size = table ? std::min(entries.size(), 1024) : 0;
        try {
            auto built = std::make_shared<std::vector<cases::Classifier>>();
            for (const double step : {0.25, 0.5, 1.0, 2.0})
                built->push_back(cases::make_classifier(entries, which, preset, size, step));
            list.emplace_back(
                which.name() + (table ? " " + std::to_string(size) : ""), [=](const DrawnSlab& s) {
                    const int at = s.length < 0.4 ? 0 : s.length < 0.8 ? 1 : s.length < 1.5 ? 2 : 3;
                    return (*built)[static_cast<std::size_t>(at)].slab(s.front, s.back);
                });
        } catch (const InputError&) {
        }
    }
    return list;
}

struct Error {
    double color_rms, color_max, alpha_rms, alpha_max;
};

Error measured(const SlabFunction& method, const std::vector<DrawnSlab>& slabs,
               const std::vector<SlabValue>& truth) {
    Error error{};
    for (std::size_t i = 0; i < slabs.size(); ++i) {
        const SlabValue value = method(slabs[i]);
        const double alpha = std::abs(value.alpha - truth[i].alpha) * 255;
        error.alpha_rms += alpha * alpha / static_cast<double>(slabs.size());
        error.alpha_max = std::max(error.alpha_max, alpha);
        for (int k = 0; k < 3; ++k) {
            const double color = std::abs(value.color[k] - truth[i].color[k]) * 255;
            error.color_rms += color * color / static_cast<double>(3 * slabs.size());
            error.color_max = std::max(error.color_max, color);
        }
    }
    error.color_rms = std::sqrt(error.color_rms);
    error.alpha_rms = std::sqrt(error.alpha_rms);
    return error;
}

struct Row {
    int bits;
    std::string reach, function, method;
    Error error;
};

void print_json(const std::vector<Row>& rows) {
    std::printf("[\n");
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const auto& [bits, reach, function, method, e] = rows[i];
        std::printf(
            "  {\"bits\": %d, \"slabs\": \"%s\", \"function\": \"%s\", \"method\": \"%s\", \"color_rms\": "
            "%.4g, \"color_max\": %.4g, "
            "\"alpha_rms\": %.4g, \"alpha_max\": %.4g}%s\n",
            bits, reach.c_str(), function.c_str(), method.c_str(), e.color_rms, e.color_max, e.alpha_rms,
            e.alpha_max, i + 1 < rows.size() ? "," : "");
    }
    std::printf("]\n");
}

/// Two decimals below 10, none from 100 on.
std::string lsb8(double value) {
    char text[32];
    std::snprintf(text, sizeof text, value < 9.995 ? "%.2f" : value < 99.95 ? "%.1f" : "%.0f", value);
    return text;
}

/// A table for each width and reach; a row for each function and method.
void print_markdown(const std::vector<Row>& rows) {
    for (std::size_t begin = 0; begin < rows.size();) {
        std::size_t end = begin;
        while (end < rows.size() && rows[end].bits == rows[begin].bits &&
               rows[end].reach == rows[begin].reach)
            ++end;
        std::vector<std::string> names, columns;
        for (std::size_t i = begin; i < end; ++i) {
            if (std::find(names.begin(), names.end(), rows[i].method) == names.end())
                names.push_back(rows[i].method);
            if (std::find(columns.begin(), columns.end(), rows[i].function) == columns.end())
                columns.push_back(rows[i].function);
        }
        std::printf("\n### %d-bit scalars, %s\n\n| method |", rows[begin].bits, rows[begin].reach.c_str());
        for (const auto& column : columns) std::printf(" %s |", column.c_str());
        std::printf("\n|---|");
        for (std::size_t i = 0; i < columns.size(); ++i) std::printf("---|");
        for (const auto& name : names) {
            std::printf("\n| %s |", name.c_str());
            for (const auto& column : columns) {
                std::string cell = "refused";
                for (std::size_t i = begin; i < end; ++i)
                    if (rows[i].method == name && rows[i].function == column)
                        cell = lsb8(rows[i].error.color_rms) + "/" + lsb8(rows[i].error.color_max);
                std::printf(" %s |", cell.c_str());
            }
        }
        std::printf("\n");
        begin = end;
    }
}

}  // namespace

int main(int argc, char** argv) {
    std::string preset;
    bool markdown = false;
    for (int i = 1; i < argc; ++i) {
        if (std::strcmp(argv[i], "--markdown") == 0) markdown = true;
        if (std::strcmp(argv[i], "--words") == 0 && i + 1 < argc) preset = argv[++i];
    }
    std::vector<Row> rows;
    for (const int bits : preset.empty() ? std::vector{8, 12, 16} : std::vector{8, 12}) {
        const int size = 1 << bits;
        struct Reach {
            const char* name;
            double of_range;
            int count;
        };
        const auto list = functions(size);
        std::vector<std::vector<std::pair<std::string, SlabFunction>>> built;
        for (const auto& function : list)
            built.push_back(preset.empty() ? methods(function.entries)
                                           : methods_in_words(function.entries, preset));
        for (const Reach& reach : {Reach{"slabs up to 2 % of the range", 0.02, bits == 16 ? 200 : 1000},
                                   Reach{"jumps over the range", 1,
                                         bits == 8    ? 1000
                                         : bits == 12 ? 200
                                                      : 40}}) {
            const std::vector<DrawnSlab> slabs = drawn(size, reach.of_range, reach.count);
            for (std::size_t f = 0; f < list.size(); ++f) {
                std::vector<SlabValue> truth;
                for (const DrawnSlab& s : slabs)
                    truth.push_back(exact_slab(list[f].entries, s.front, s.back, s.length));
                for (const auto& [name, method] : built[f])
                    rows.push_back({bits, reach.name, list[f].name, name, measured(method, slabs, truth)});
            }
        }
    }
    if (markdown)
        print_markdown(rows);
    else
        print_json(rows);
}
