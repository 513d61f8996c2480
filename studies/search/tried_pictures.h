// The pictures that a search by pictures draws: every scene from every view, each once, kept in its folder.
#pragma once

#include "studies/search/search.h"
#include "studies/search/variables.h"
#include "studies/sweep/run_folder.h"

#include <map>
#include <mutex>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace squint::search {

/// A view: camera settings for each scene.
struct View {
    double degrees = 0;
    bool held_out = false;                            // nothing was decided by it
    std::vector<std::vector<std::string>> overrides;  // by scene
};

struct Picture {
    sweep::Prepared prepared;
    sweep::ListedPoint entry;
    std::size_t scene = 0;
};

/// What the report says of a picture.
struct Reason {
    std::string phase;
    int restart = 0;
    std::pair<std::string, std::string> varied{};  // axis and label, if one variable differs
};

/// Means over pictures, and the worst of them.
struct Summary {
    Trial trial;
    double bits = 0, table_bytes = 0, ms = 0;
    std::string failure;  // of the first picture that failed
};

class TriedPictures {
  public:
    TriedPictures(const Settings& settings, const sweep::SweepFile& sweep, Scenes& scenes,
                  const Variables& variables);

    /// Views to tune on: the turns 0, 1/n, 2/n ...
    void add_views();
    /// Adds a set of views that decide nothing; those held out before decide from now on.
    void hold_out();
    int sets() const { return sets_; }  // held out so far
    static int held_out_a_set(const Settings& settings);
    /// All views decide.
    void let_all_decide();
    const std::vector<View>& views() const { return views_; }

    /// Every scene in these formats, from the views that decide or from those held out.
    std::vector<Picture> pictures(const sweep::Point& formats, const Reason& reason, bool held_out) const;
    /// Their records, in order: those that exist are read, others computed.
    std::vector<sweep::Json> records(std::vector<Picture>& pictures);
    Summary summary(std::span<const Picture> pictures, std::span<const sweep::Json> records) const;

    /// sweep.json of all that was tried.
    sweep::Json trail() const { return sweep::sweep_record(sweep_, entries_, wanted_); }
    /// So far: pictures, and of them those computed now, those that failed, those of another build.
    struct Counts {
        std::size_t pictures = 0, computed = 0, failed = 0, other_program = 0;
    };
    const Counts& counts() const { return counts_; }

  private:
    void add_view(int frame, int grid, bool held_out);
    std::vector<std::string> turned(std::size_t scene, int frame, int grid);

    const Settings& s_;
    const sweep::SweepFile& sweep_;
    Scenes& scenes_;
    const Variables& variables_;
    int threads_, sets_ = 0;
    std::vector<std::string> wanted_;
    std::vector<View> views_;
    std::vector<sweep::ListedPoint> entries_;
    std::map<std::string, sweep::Json> records_;  // by hash
    Counts counts_;
    std::mutex mutex_;
};

}  // namespace squint::search
