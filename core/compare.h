// Differences between two images, channel by channel.
#pragma once

#include "core/image.h"

#include <optional>
#include <string>
#include <vector>

namespace squint {

/// Differences of one channel over all pixels, or over the foreground (A > 0 in either image; all pixels
/// where there is no A).  LSB8 is 1/255 of full scale.  Channels of words are compared as signed raw
/// integers; they have no peak, so neither psnr nor ssim.
struct Difference {
    std::string channel;
    std::int64_t pixels = 0;
    bool identical = false;
    std::optional<double> psnr;  // dB, peak 1; none when identical
    double rmse = 0, bias = 0;   // a - b
    double largest = 0;          // |a - b|
    int largest_x = 0, largest_y = 0;
    std::optional<double>
        ssim;  // over all pixels: whole 11x11 Gaussian windows, sigma 1.5; none in smaller pictures
};
struct Comparison {
    std::vector<Difference> all,
        foreground;  // one a channel; the last, "RGB", joins the colours where all three are there
    const Difference& channel(const std::string& name, bool of_foreground) const;
};

/// Compares images of equal size, placement and channels; throws InputError where they differ or a value is
/// not finite.  `srgb` encodes R, G and B first (below 0 is 0): differences as a display shows them.
Comparison compare(const Image& a, const Image& b, bool srgb = false, bool with_ssim = true);

/// gain (a - b), signed, as floats, with the channels of `a`.  Throws InputError when sizes or channel names
/// differ.
Image difference(const Image& a, const Image& b, double gain = 1);

}  // namespace squint
