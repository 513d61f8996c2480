// The two files that a search leaves: the formats that it found, and its record.
#pragma once

#include "scene/wires.h"
#include "studies/search/search.h"
#include "studies/sweep/evaluate.h"

#include <string>
#include <vector>

namespace squint::search {

std::string formats_file(const std::string& folder);

/// Deletes both, if they are there.
void remove_result_files(const std::string& folder);

/// formats.toml: `about` in lines that begin with #, the preset, and the wires with their formats, in order.
/// Throws InputError where it cannot be written, as the next does.
void write_formats(const std::string& folder, const std::string& about, const std::string& preset,
                   const std::vector<Wire>& wires, const std::vector<Spec>& specs);
/// search.json: the record, as docs/sweeps.md lists it.
void write_search_record(const std::string& folder, const sweep::Json& record);

/// The head of squint.search/1: schema, program, command, scenes and the bound asked for.
sweep::Json begin_record(const Settings& settings);
/// Wires by name, each with its format.
sweep::Json formats_record(const std::vector<Wire>& wires, const std::vector<Spec>& specs);

}  // namespace squint::search
