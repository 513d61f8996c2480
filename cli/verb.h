// A verb of the program.  Its file holds all of it: arguments, flags, help, and what it does.
#pragma once

#include "cli/flags.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace squint::cli {

struct Verb {
    const char *name, *heading, *help, *footer;  // heading: the job under which help lists it
    /// Describes its flags.  What it returns is called after they were read, and runs the verb: it returns an
    /// exit code, or throws InputError.
    std::function<int()> (*describe)(Flags&);
};

/// Verb::describe of a structure of arguments, a function that describes them and one that runs with them.
template <class Arguments, void (*flags)(Flags&, Arguments&), int (*run)(const Arguments&)>
std::function<int()> described(Flags& f) {
    const auto arguments = std::make_shared<Arguments>();
    flags(f, *arguments);
    return [arguments] { return run(*arguments); };
}

/// All verbs, in the order of help.
const std::vector<const Verb*>& all_verbs();

}  // namespace squint::cli
