#include "pipeline/plan/asked.h"

#include "core/error.h"

#include <string>
#include <utility>

namespace squint {
namespace {

/// The setting that a plan's message is about: the one it begins with, or, for a section, the first that it
/// names.  Empty if none was given.
std::string setting_meant(const Scene& scene, const std::string& key, const std::string& message) {
    if (scene.given_at.contains(key)) return key;
    std::string meant;
    std::size_t first = std::string::npos;
    for (const auto& [given, place] : scene.given_at) {
        if (!given.starts_with(key + '.')) continue;
        const std::size_t at = message.find(' ' + given.substr(key.size() + 1) + ' ');
        if (at < first) first = at, meant = given;
    }
    return meant;
}

}  // namespace

Plan plan_asked_for(const Scene& scene, std::shared_ptr<const Volume> volume, int frame) {
    try {
        return make_plan(scene, std::move(volume), frame);
    } catch (const InputError& error) {
        const std::string message = error.what(), key = message.substr(0, message.find(':'));
        const auto given = setting_meant(scene, key, message);
        if (given.empty()) throw;
        throw InputError(where(scene, given) + message.substr(key.size()));
    }
}

}  // namespace squint
