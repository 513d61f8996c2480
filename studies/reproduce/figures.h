// Figures and tables of the papers as data: which pictures, which measurements, and the paper's numbers.  One
// file in configs/reproduce and one page in docs/papers for each paper.
#pragma once

#include <string>
#include <vector>

namespace squint::reproduce {

enum class PictureKind {
    render,      // by the pipeline
    reference,   // the exact integral along each ray
    difference,  // of two pictures: first - second
    angles,      // between the raw gradients of neighbouring samples (Guetat et al., figure 3)
    slab_light,  // a plot of light along one slab (Guetat et al., figure 1)
};

struct PictureOrder {
    PictureKind kind = PictureKind::render;
    std::string name, title;
    std::string scene;                  // "@lee_shin/figure_5"; empty: the figure's
    std::vector<std::string> settings;  // key=value, over the figure's
    std::vector<std::string> of;        // difference: two pictures
    double gain = 1;                    // difference: of its preview
    double angle = 90, exponent = 50;   // slab_light: between the ends' normals, in degrees; of the highlight
};

enum class Measure {
    psnr,             // R, G, B of two pictures over all pixels, dB
    foreground_psnr,  // of two pictures, RGB, dB
    rms,              // of two pictures, RGB over the foreground, LSB8
    largest,          // the largest difference of R, G and B over the foreground, LSB8
    bias,             // A of the first less that of the second, LSB8
    opacity,          // of a picture's middle pixel, %
    slab_error,       // of the method on its own hard slabs against the exact integral, LSB8 (`squint hard`)
    table_size,       // of the method's tables, KiB
    build_time,       // from control points to the tables' words, ms
    frames,           // a second, over the scene's turntable
    angles,  // visible slabs whose ends' gradients stand more than 60 and more than 90 degrees apart, %
    normal_length,  // slab_light: what the linear and the quadratic normal miss of a length of one, %
};
/// The unit of a measure's numbers: "dB", "LSB8", ...
const char* unit_of(Measure measure);

struct RowOrder {
    Measure measure = Measure::psnr;
    std::string what;             // one line
    std::vector<std::string> of;  // pictures of the figure
    std::string scene;            // of measures that make no picture
    std::vector<std::string> settings;
    std::vector<double> paper;  // its numbers, in order; empty: it has none
};

struct Figure {
    std::string name;    // "figure_5"
    std::string title;   // one sentence
    std::string look;    // what to look for
    double seconds = 0;  // on two cores
    bool timed = false;  // it measures time and takes long: made only when asked for by name
    std::string scene;
    std::string stand_in;  // the scene used where data is missing; empty: the built-in one
    std::vector<std::string> settings;
    std::vector<PictureOrder> pictures;
    std::vector<RowOrder> rows;
    std::vector<std::string> rows_of;  // a table made of other figures' rows
};

struct Paper {
    std::string name;   // "lee_shin": the file's
    std::string title;  // authors, title, year
    std::vector<Figure> figures;
    const Figure* find(const std::string& figure) const;
};

/// Throws InputError `file:line:column: ...`.
Paper read_paper(const std::string& path);

}  // namespace squint::reproduce
