// In place of core/image.cpp and core/nrrd.cpp: pictures in memory, no files.
#include "core/error.h"
#include "core/image.h"
#include "core/nrrd.h"

namespace squint {

Channel* Image::find(const std::string& name) {
    for (Channel& channel : channels)
        if (channel.name == name) return &channel;
    return nullptr;
}
const Channel* Image::find(const std::string& name) const {
    return const_cast<Image*>(this)->find(name);
}
Channel& Image::add_float(std::string name) {
    channels.push_back({std::move(name), {}, {}});
    channels.back().values.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), 0);
    return channels.back();
}
Channel& Image::add_words(std::string name) {
    channels.push_back({std::move(name), {}, {}});
    channels.back().words.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), 0);
    return channels.back();
}

bool is_nrrd(const MappedFile&) {
    throw InputError("this build reads no files");
}
StoredVolume read_nrrd(const std::string&, const MappedFile&, const LoadLimits&, std::vector<std::string>&) {
    throw InputError("this build reads no files");
}

}  // namespace squint
