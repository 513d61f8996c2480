// squint search --guarantee pictures: formats under whose roundings no pixel of given pictures can err by more than a
// bound, by certificates (pipeline/machines/certificate.h) and not by trying.
//
// A wire's share of a bound halves with every bit.  With n payers, equal shares of what walls, termination and rows of
// tables leave of the bound take the fewest bits where a bit costs alike:
//
//     F' = F + ceil(log2(n share / left)),
//
// from each wire's greatest share over all pixels.  Then bits are taken back where the tally says that they are dear
// and the certificates that they are not needed.
#pragma once

#include "studies/search/search.h"

namespace squint::search {

/// Formats, what is proven of them and what was measured, LSB8; of several pictures the greatest.
struct Proven {
    WireSpecs specs;  // of the first scene's first view
    double bits = 0;  // by the tally: mean over the scenes
    double bound = 0, error = 0;
    std::int64_t rays = 0, undecided = 0;
};

struct CertifiedResult {
    std::vector<Wire> wires;  // that were chosen
    Proven found, scene;
    std::vector<double> degrees;   // of the pictures
    std::size_t pictures = 0;      // the certificates are of so many
    std::size_t certificates = 0;  // computed on the way
    Wire binding{};                // whose share of the bound is the greatest
    std::string failure;           // why no formats were found; then there is no file
    std::string formats_file;
    sweep::Json json;  // squint.search/1
};

/// Takes scenes, overrides, most_error, wires, views, folder, command, threads, cancelled, progress of the settings.
/// Throws InputError for what is not bounded or cannot be used, and Cancelled.
CertifiedResult run_by_certificate(const Settings& settings);

}  // namespace squint::search
