// Scenes and sweeps that come with squint: @lee_shin/figure_5 is lee_shin/figure_5.toml in a folder of them.
#pragma once

#include <string>
#include <vector>

namespace squint {

/// The names of what is in `folder` ("@lee_shin/figure_5"), sorted; none if it is missing.
std::vector<std::string> shelf(const std::string& folder);

/// Files that say how the figures of the papers are made, sorted.
std::vector<std::string> papers(const std::string& folder);

/// The file of "@lee_shin/figure_5" in `folder`; a name without @ stays as it is.  Throws InputError for a name
/// that `folder` lacks.
std::string shelf_file(const std::string& name, const std::string& folder);

}  // namespace squint
