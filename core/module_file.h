// The file that this code is part of.
#pragma once

#include <string>

namespace squint {

/// The absolute path of the program, or, in another program (Python), of the module that contains this code.
std::string module_file();

}  // namespace squint
