// Scenes and sweeps that come with the program: @lee_shin/figure_5 is configs/lee_shin/figure_5.toml, found
// in share/squint of an installation or a build tree.
#pragma once

#include <string>
#include <vector>

namespace squint::cli {

/// "@lee_shin/figure_5" -> its file; other names stay.  Throws InputError if there is no such file.
std::string file_of(const std::string& name);

/// "@lee_shin/figure_5" and all others, sorted; none where the folder is missing.
std::vector<std::string> shelf();

/// Files that say how the papers' figures are made, in order of name.
std::vector<std::string> papers();

}  // namespace squint::cli
