// Scenes and sweeps that come with the program: @lee_shin/figure_5 is configs/lee_shin/figure_5.toml, found in
// share/squint of an installation or of a build tree.
#pragma once

#include <string>
#include <vector>

namespace squint::cli {

/// "@lee_shin/figure_5" -> its file; another name stays as it is.  Throws InputError for a name that is not there.
std::string file_of(const std::string& name);

/// "@lee_shin/figure_5" and so on, in order of name; none where the folder is missing.
std::vector<std::string> shelf();

}  // namespace squint::cli
