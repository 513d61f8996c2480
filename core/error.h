// Errors that a user can mend: a file, a flag or a scene that cannot be used.  All other errors are bugs, for
// assert.
#pragma once

#include <stdexcept>
#include <string>

namespace squint {

/// Bad input.  what() is one line: `where: what, what was found, what is allowed`.  The program exits with 2.
class InputError : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

}  // namespace squint
