// squint search --guarantee pictures: formats under whose roundings no pixel of given pictures can err by more than a
// bound, by certificates (pipeline/machines/certificate.h) and not by trying.
//
// How: studies/search/by_shares.h.
#pragma once

#include "studies/search/search.h"

namespace squint::search {

/// Formats, what is proven of them and what was measured, in LSB8: the greatest over the pictures.
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

/// Reads scenes, overrides, most_error, wires, views, folder, command, threads, cancelled and progress.
/// Throws InputError for scenes that cannot be bounded or used, and Cancelled.
CertifiedResult run_by_certificate(const Settings& settings);

}  // namespace squint::search
