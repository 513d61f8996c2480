// The files of a run's folder (run.h draws it): records of points, the list of them, what worked there.
#pragma once

#include "studies/sweep/evaluate.h"

#include <cstddef>
#include <string>
#include <vector>

namespace squint::sweep {

/// Makes it and its rooms.  Throws InputError where that is not possible.
void make_run_folder(const std::string& folder);

std::string point_path(const std::string& folder, const std::string& hash);

/// JSON as every file of a run holds it.
std::string dump(const Json& json);

/// "key=value" settings, as TOML, of which the last of a key wins -> {key: typed value}, in the order given; and back,
/// from an object (squint.point/2) or a list of such settings (squint.point/1).
Json settings_record(const std::vector<std::string>& settings);
std::vector<std::string> settings_of(const Json& recorded);

/// Whether a record is there, whole, and holds all that is wanted; a failed one is as good as none.
enum class RecordState { missing, reusable, other_program };
RecordState state_of(const std::string& path, const std::vector<std::string>& wanted);

/// Measures a point and writes its record into the evaluator's folder.  A point that fails has a record too,
/// with the reason.  Throws Cancelled, and InputError where nothing can be written.
Json write_record(Evaluator& evaluator, const Prepared& point, const std::string& folder, int threads,
                  bool timed);

/// One of a sweep's points: where it stands in the list and what names it.
struct ListedPoint {
    Point point;
    std::string hash;
};
/// What sweep.json holds: the points in order, each by its hash, and what was asked for.
Json sweep_record(const SweepFile& sweep, const std::vector<ListedPoint>& entries,
                  const std::vector<std::string>& wanted);

/// RUN/runs/*.json: a file for every time that the program worked in a folder, written anew as it goes on.
class RunLog {
  public:
    struct Counts {
        std::size_t computed = 0, reused = 0, failed = 0;
    };
    RunLog(std::string folder, Json about);
    void write(const char* state, double seconds, const Counts& counts);

  private:
    std::string path_;
    Json about_;
};

}  // namespace squint::sweep
