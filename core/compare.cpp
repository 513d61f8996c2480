#include "core/compare.h"

#include "core/error.h"
#include "core/portable_math.h"
#include "core/srgb.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <span>

namespace squint {
namespace {

constexpr int kWindow = 11;  // pixels on a side (Wang et al. 2004, section III.C)
constexpr double kSigma = 1.5;
constexpr double kC1 = 0.01 * 0.01, kC2 = 0.03 * 0.03;  // (K L)^2 with peak L = 1
constexpr double kLn10 = 0x1.26bb1bbb55516p+1;

/// One channel as doubles: floats, or words as signed integers.
std::vector<double> values_of(const Channel& channel, bool encode) {
    std::vector<double> values;
    if (channel.is_words()) {
        values.reserve(channel.words.size());
        for (const std::uint32_t word : channel.words) values.push_back(static_cast<std::int32_t>(word));
    } else {
        values.assign(channel.values.begin(), channel.values.end());
    }
    if (encode) std::transform(values.begin(), values.end(), values.begin(), srgb_from_linear);
    return values;
}

bool is_color(const std::string& name) {
    return name == "R" || name == "G" || name == "B";
}

std::string names(const Image& image) {
    std::string all;
    for (const Channel& channel : image.channels) all += (all.empty() ? "" : " ") + channel.name;
    return all;
}

/// Sums of a - b over pixels, for one channel or several.
struct Sums {
    std::int64_t count = 0;
    double sum = 0, squares = 0, largest = 0;
    std::size_t largest_at = 0;

    void add(const Sums& other) {
        count += other.count, sum += other.sum, squares += other.squares;
        if (other.largest > largest) largest = other.largest, largest_at = other.largest_at;
    }
};

/// Sums each row apart, so that rounding grows with width + height, not with their product.
Sums differences(std::span<const double> a, std::span<const double> b, std::span<const std::uint8_t> chosen,
                 int width) {
    Sums all;
    for (std::size_t row = 0; row < a.size(); row += static_cast<std::size_t>(width)) {
        Sums line;
        for (std::size_t i = row; i < row + static_cast<std::size_t>(width); ++i) {
            if (!chosen.empty() && !chosen[i]) continue;
            const double difference = a[i] - b[i];
            ++line.count, line.sum += difference, line.squares += difference * difference;
            if (std::fabs(difference) > line.largest)
                line.largest = std::fabs(difference), line.largest_at = i;
        }
        all.add(line);
    }
    return all;
}

Difference figures(const std::string& channel, const Sums& sums, std::int64_t pixels, int width,
                   bool has_peak) {
    Difference d;
    d.channel = channel, d.pixels = pixels;
    d.identical = sums.largest == 0;
    if (sums.count > 0) {
        d.rmse = std::sqrt(sums.squares / static_cast<double>(sums.count));
        d.bias = sums.sum / static_cast<double>(sums.count);
    }
    d.largest = sums.largest;
    d.largest_x = static_cast<int>(sums.largest_at % static_cast<std::size_t>(width));
    d.largest_y = static_cast<int>(sums.largest_at / static_cast<std::size_t>(width));
    if (!d.identical && has_peak) d.psnr = -20 / kLn10 * portable::log(d.rmse);
    return d;
}

std::array<double, kWindow> gaussian() {
    std::array<double, kWindow> weight{};
    double total = 0;
    for (int i = 0; i < kWindow; ++i) {
        const double x = (i - kWindow / 2) / kSigma;
        total += weight[static_cast<std::size_t>(i)] = portable::exp(-0.5 * x * x);
    }
    for (double& w : weight) w /= total;
    return weight;
}

/// Gaussian means over every whole window of the picture, row by row.  The filter is separable, and the inner
/// loops run along x.
class Blur {
  public:
    Blur(int width, int height)
        : width_(static_cast<std::size_t>(width)),
          out_width_(width_ - kWindow + 1),
          lines_(static_cast<std::size_t>(height), std::vector<double>(out_width_)) {}

    std::size_t out_width() const { return out_width_; }

    void load(std::span<const double> values) {
        for (std::size_t y = 0; y < lines_.size(); ++y)
            weigh(lines_[y], [&](std::size_t k) { return values.data() + y * width_ + k; });
    }
    void row(std::size_t y, std::vector<double>& mean) const {
        mean.resize(out_width_);
        weigh(mean, [&](std::size_t k) { return lines_[y + k].data(); });
    }

  private:
    /// into[x] = sum of weight[k] taps(k)[x], in that order: vectors along x, eleven products in a register.
    template <class Taps>
    void weigh(std::vector<double>& into, Taps taps) const {
        std::array<const double*, kWindow> from;
        for (std::size_t k = 0; k < kWindow; ++k) from[k] = taps(k);
        const std::array<double, kWindow> weight = weight_;
        double* __restrict const out = into.data();
        for (std::size_t x = 0; x < out_width_; ++x) {
            double sum = 0;
            for (std::size_t k = 0; k < kWindow; ++k) sum += weight[k] * from[k][x];
            out[x] = sum;
        }
    }

    std::size_t width_, out_width_;
    std::array<double, kWindow> weight_ = gaussian();
    std::vector<std::vector<double>> lines_;
};

/// Mean structural similarity over all whole 11 x 11 windows (Wang et al. 2004, equation 13); none in a
/// smaller picture.
std::optional<double> ssim(std::span<const double> a, std::span<const double> b, int width, int height) {
    if (width < kWindow || height < kWindow) return std::nullopt;
    std::array<Blur, 5> blurs{Blur(width, height), Blur(width, height), Blur(width, height),
                              Blur(width, height), Blur(width, height)};
    const auto products = [&](std::span<const double> p, std::span<const double> q) {
        std::vector<double> product(p.size());
        for (std::size_t i = 0; i < p.size(); ++i) product[i] = p[i] * q[i];
        return product;
    };
    blurs[0].load(a), blurs[1].load(b);
    blurs[2].load(products(a, a)), blurs[3].load(products(b, b)), blurs[4].load(products(a, b));

    const std::size_t out_width = blurs[0].out_width(),
                      out_height = static_cast<std::size_t>(height - kWindow + 1);
    double total = 0;
    std::array<std::vector<double>, 5> mean;
    for (std::size_t y = 0; y < out_height; ++y) {
        for (std::size_t i = 0; i < mean.size(); ++i) blurs[i].row(y, mean[i]);
        double line = 0;
        for (std::size_t x = 0; x < out_width; ++x) {
            const double m_a = mean[0][x], m_b = mean[1][x];
            const double variance = (mean[2][x] - m_a * m_a) + (mean[3][x] - m_b * m_b);
            const double covariance = mean[4][x] - m_a * m_b;
            line += (2 * (m_a * m_b) + kC1) * (2 * covariance + kC2) /
                    ((m_a * m_a + m_b * m_b + kC1) * (variance + kC2));
        }
        total += line;
    }
    return total / static_cast<double>(out_width * out_height);
}

void check_same_shape(const Image& a, const Image& b) {
    if (a.width != b.width || a.height != b.height)
        throw InputError(
            fmt::format("compare: sizes differ, {} x {} and {} x {}", a.width, a.height, b.width, b.height));
    if (a.left != b.left || a.top != b.top)
        throw InputError(
            fmt::format("compare: the pictures lie at different places, from x {}, y {} and x {}, y {} "
                        "(the data windows of their files)",
                        a.left, a.top, b.left, b.top));
    if (a.channels.empty() || a.width < 1 || a.height < 1)
        throw InputError("compare: the images have no pixels");
    for (const auto& [one, other] : {std::pair{&a, &b}, std::pair{&b, &a}})
        for (const Channel& channel : one->channels) {
            const Channel* found = other->find(channel.name);
            if (!found)
                throw InputError(
                    fmt::format("compare: channels differ, \"{}\" and \"{}\"", names(a), names(b)));
            if (found->is_words() != channel.is_words())
                throw InputError(fmt::format(
                    "compare: channel {} holds words in one image and floats in the other", channel.name));
        }
}

/// Throws for a value that is not finite: a picture of NaN must never pass.
void check_finite(const Image& image, const char* which) {
    for (const Channel& channel : image.channels) {
        const auto bad = [](float value) { return !std::isfinite(value); };
        const auto count = std::count_if(channel.values.begin(), channel.values.end(), bad);
        if (count == 0) continue;
        const auto at =
            std::find_if(channel.values.begin(), channel.values.end(), bad) - channel.values.begin();
        throw InputError(
            fmt::format("compare: {} image, channel {}: {} values are not finite, the first at x {}, y {}",
                        which, channel.name, count, at % image.width, at / image.width));
    }
}

/// Pixels with A > 0 in either image; all pixels where there is no A.
std::vector<std::uint8_t> foreground_of(const Image& a, const Image& b, std::size_t pixels) {
    std::vector<std::uint8_t> chosen(pixels);
    const Channel *alpha_a = a.find("A"), *alpha_b = b.find("A");
    for (std::size_t i = 0; i < pixels; ++i) {
        const bool words = alpha_a && alpha_a->is_words();
        chosen[i] = !alpha_a || (words ? (alpha_a->words[i] | alpha_b->words[i]) != 0
                                       : alpha_a->values[i] > 0 || alpha_b->values[i] > 0);
    }
    return chosen;
}

}  // namespace

const Difference& Comparison::channel(const std::string& name, bool of_foreground) const {
    const auto& list = of_foreground ? foreground : all;
    const auto found =
        std::find_if(list.begin(), list.end(), [&](const Difference& d) { return d.channel == name; });
    if (found == list.end()) throw InputError(fmt::format("compare: there is no channel {}", name));
    return *found;
}

Comparison compare(const Image& a, const Image& b, bool srgb, bool with_ssim) {
    check_same_shape(a, b);
    check_finite(a, "first"), check_finite(b, "second");
    const std::size_t pixels = static_cast<std::size_t>(a.width) * static_cast<std::size_t>(a.height);
    const auto chosen = foreground_of(a, b, pixels);
    const std::int64_t foreground_pixels = std::count(chosen.begin(), chosen.end(), 1);

    Comparison result;
    Sums color_all, color_foreground;
    double color_ssim = 0;
    int colors = 0;
    for (const Channel& channel : a.channels) {
        const bool color = is_color(channel.name) && !channel.is_words();
        const auto of_a = values_of(channel, srgb && color),
                   of_b = values_of(*b.find(channel.name), srgb && color);
        const Sums all = differences(of_a, of_b, {}, a.width);
        const Sums front = differences(of_a, of_b, chosen, a.width);
        const bool has_peak = !channel.is_words();
        result.all.push_back(
            figures(channel.name, all, static_cast<std::int64_t>(pixels), a.width, has_peak));
        result.foreground.push_back(figures(channel.name, front, foreground_pixels, a.width, has_peak));
        if (with_ssim && has_peak) result.all.back().ssim = ssim(of_a, of_b, a.width, a.height);
        if (!color) continue;
        ++colors, color_all.add(all), color_foreground.add(front);
        color_ssim += result.all.back().ssim.value_or(0);
    }
    if (colors == 3) {
        const bool has_ssim = result.channel("R", false).ssim.has_value();
        result.all.push_back(figures("RGB", color_all, static_cast<std::int64_t>(pixels), a.width, true));
        result.foreground.push_back(figures("RGB", color_foreground, foreground_pixels, a.width, true));
        if (has_ssim) result.all.back().ssim = color_ssim / 3;
    }
    return result;
}

Image difference(const Image& a, const Image& b, double gain) {
    check_same_shape(a, b);
    Image result{a.width, a.height, {}};
    for (const Channel& channel : a.channels) {
        const auto of_a = values_of(channel, false), of_b = values_of(*b.find(channel.name), false);
        std::vector<float>& values = result.add_float(channel.name).values;
        for (std::size_t i = 0; i < values.size(); ++i)
            values[i] = static_cast<float>((of_a[i] - of_b[i]) * gain);
    }
    return result;
}

}  // namespace squint
