#include "studies/sweep/ways.h"

#include "fixedpoint/words/branching.h"
#include "pipeline/slab-inl.h"
#include "pipeline/stages/ray_setup-inl.h"

#include <map>
#include <tuple>
#include <utility>

namespace squint::sweep {
namespace {

using namespace HWY_NAMESPACE;

// Listens to the branches of one ray after the other.
class WayListener : public Silent {
  public:
    WayListener() { Branching::ways = &now_; }
    WayListener(const WayListener&) = delete;
    ~WayListener() { Branching::ways = nullptr; }
    void begin_ray() {
        is_first_ = true, after_lit_ = is_lit_ = looked_twice_ = false, before_.clear(), now_.clear();
    }
    void at(Part part) { is_lit_ = is_lit_ || part == Part::normal; }
    void looked_twice() { looked_twice_ = true; }
    void composited(const auto&, const auto&, const auto&) {
        // What a neighbour leaves is the sample between them, and its gradient where it was lit as a whole.
        SlabWay& way = ways_[{is_first_, after_lit_, now_}];
        if (way.slabs++ == 0) way.is_first = is_first_, way.before = before_, way.ways = now_;
        is_first_ = false, after_lit_ = is_lit_ && !looked_twice_;
        is_lit_ = looked_twice_ = false;
        std::swap(before_, now_);
        now_.clear();
    }
    std::vector<SlabWay> ways() const {
        std::vector<SlabWay> all;
        for (const auto& [key, way] : ways_) all.push_back(way);
        return all;
    }

  private:
    bool is_first_ = true, after_lit_ = false, is_lit_ = false, looked_twice_ = false;
    std::string before_, now_;
    std::map<std::tuple<bool, bool, std::string>, SlabWay> ways_;
};

}  // namespace

PictureWays ways_of(const Plan& plan, int most) {
    PictureWays picture;
    WayListener listener;
    const int across = (plan.camera.width + most - 1) / most, down = (plan.camera.height + most - 1) / most;
    std::visit(
        [&](const auto& method) {
            for (int row = down / 2; row < plan.camera.height; row += down)
                for (int column = across / 2; column < plan.camera.width; column += across) {
                    const RaySetup ray = plan.set_up(column, row);
                    if (ray.slabs == 0) continue;
                    listener.begin_ray();
                    Pixel<Branching> pixel;
                    cast_ray(plan, method, FromVolume{*plan.volume}, ray_words<Branching>(plan, ray),
                             ray.slabs, listener, pixel);
                    ++picture.rays, picture.slabs += pixel.samples;
                }
        },
        plan.method);
    picture.ways = listener.ways();
    return picture;
}

}  // namespace squint::sweep
