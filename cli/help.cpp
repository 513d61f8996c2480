// squint help: the help of the program or of a verb, as text, a man page or a shell's completion.
#include "cli/command_line.h"
#include "cli/common.h"
#include "cli/shelf.h"
#include "cli/verb.h"

namespace squint::cli {
namespace {

struct HelpArguments {
    std::string verb, form;
    bool list = false;
};

void flags(Flags& f, HelpArguments& a) {
    f.add("verb", a.verb, "A verb").value("VERB");
    f.add("--form", a.form,
          "As a man page (of squint, of a verb, of a scene's keys) or as a shell's completion")
        .one_of({std::begin(kManualForms), std::end(kManualForms)})
        .value("NAME");
    f.add("--list", a.list,
          "List the scenes and sweeps that come with squint: @lee_shin/figure_5 and others");
}

int run(const HelpArguments& a) {
    std::string text;
    if (a.list) {
        for (const std::string& name : shelf()) text += name + "\n";
    } else {
        text = help_text(a.verb);  // refuses a verb that there is not
        if (!a.form.empty()) text = manual(program_text(), a.form, a.verb);
    }
    return print(text), kDone;
}

}  // namespace

namespace verbs {
extern const Verb help{
    .name = "help",
    .heading = "This program",
    .help = "Show this help, or a verb's",
    .footer =
        "Examples:\n  squint help render\n  squint help render --form man | man -l -\n"
        "  source <(squint help --form bash)",
    .describe = described<HelpArguments, flags, run>,
};
}

}  // namespace squint::cli
