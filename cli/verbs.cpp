// The list of verbs, in the order of help within a heading.  Each is defined in a file of its name.
#include "cli/verb.h"

#define SQUINT_VERBS(VERB) \
    VERB(render)           \
    VERB(compare)          \
    VERB(plan)             \
    VERB(pixel)            \
    VERB(table)            \
    VERB(number)           \
    VERB(hard)             \
    VERB(sweep)            \
    VERB(search)           \
    VERB(report)           \
    VERB(reproduce)        \
    VERB(info)             \
    VERB(volume)           \
    VERB(doctor)           \
    VERB(help)

namespace squint::cli {

namespace verbs {
#define SQUINT_DECLARED(name) extern const Verb name;
SQUINT_VERBS(SQUINT_DECLARED)
}  // namespace verbs

const std::vector<const Verb*>& all_verbs() {
#define SQUINT_LISTED(name) &verbs::name,
    static const std::vector<const Verb*> all{SQUINT_VERBS(SQUINT_LISTED)};
    return all;
}

}  // namespace squint::cli
