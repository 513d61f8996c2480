// A cache of what is computed once for a volume, kept while its voxels live.
#pragma once

#include "core/parallel.h"
#include "core/volume.h"

#include <map>
#include <memory>
#include <mutex>

namespace squint {

template <class T>
class KeptPerVolume {
  public:
    /// What `make` returned for these voxels the last time, unless it is not `good` any more.
    template <class Make, class Good>
    std::shared_ptr<T> find(const Volume& volume, Make&& make, Good&& good) {
        const std::lock_guard lock(mutex_);
        std::erase_if(kept_, [](const auto& item) { return item.second.voxels.expired(); });
        if (const auto found = kept_.find(volume.data.get());
            found != kept_.end() && found->second.dims == volume.dims && good(*found->second.thing))
            return found->second.thing;
        std::shared_ptr<T> thing;
        isolated([&] { thing = make(); });
        kept_[volume.data.get()] = {volume.data, volume.dims, thing};
        return thing;
    }

    /// The same without a lock while it is made: of threads that make it at once, one's is kept.
    template <class Make, class Good>
    std::shared_ptr<T> find_or_make(const Volume& volume, Make&& make, Good&& good) {
        {
            const std::lock_guard lock(mutex_);
            if (const auto found = kept_.find(volume.data.get());
                found != kept_.end() && !found->second.voxels.expired() &&
                found->second.dims == volume.dims && good(*found->second.thing))
                return found->second.thing;
        }
        const std::shared_ptr<T> thing = make();
        const std::lock_guard lock(mutex_);
        std::erase_if(kept_, [](const auto& item) { return item.second.voxels.expired(); });
        kept_[volume.data.get()] = {volume.data, volume.dims, thing};
        return thing;
    }

  private:
    struct Kept {
        std::weak_ptr<const void> voxels;
        Index3 dims{0, 0, 0};
        std::shared_ptr<T> thing;
    };
    std::mutex mutex_;
    std::map<const void*, Kept> kept_;
};

}  // namespace squint
