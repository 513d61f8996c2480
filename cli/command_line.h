// What the command line says: a verb to run, or help.
#pragma once

#include "cli/manual.h"

#include <functional>
#include <string>
#include <vector>

namespace squint::cli {

/// Reads the command line.  What it returns runs the verb, or prints help: an exit code, or an InputError.
/// Throws InputError: what was found, and where help is.
std::function<int()> parse(int argc, char** argv);

/// The program as a table.
ProgramText program_text();
/// The help of a verb, or of the program where `verb` is empty.
std::string help_text(const std::string& verb);

/// "unknown WHAT "NAME"; did you mean ...?", or the list of names.
std::string unknown(const char* what, const std::string& name, const std::vector<std::string>& names);

}  // namespace squint::cli
