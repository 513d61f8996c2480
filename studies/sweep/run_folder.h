// The files in the folder of a run (drawn in run.h): records of points, their list, what worked there.
#pragma once

#include "studies/sweep/evaluate.h"

#include <cstddef>
#include <string>
#include <vector>

namespace squint::sweep {

/// Creates it and its subfolders.  Throws InputError where that is impossible.
void make_run_folder(const std::string& folder);

std::string point_path(const std::string& folder, const std::string& hash);

/// JSON in the form that every file of a run has.
/// Now, in UTC: "2026-11-29T12:50:00Z".
std::string now_text();
std::string dump(const Json& json);

/// "key=value" settings as TOML, where the last of a key wins -> {key: typed value}, in order; and back, from
/// an object (squint.point/2) or from a list of settings (squint.point/1).
Json settings_record(const std::vector<std::string>& settings);
std::vector<std::string> settings_of(const Json& recorded);

/// Whether a record exists, is complete and holds all that is wanted; a failed one counts as missing.
enum class RecordState { missing, reusable, other_program };
RecordState state_of(const std::string& path, const std::vector<std::string>& wanted);

/// Measures a point and writes its record into the evaluator's folder; a point that fails has a record with
/// the reason.  `base`: see Evaluator::measure().  Throws Cancelled, and InputError where nothing can be written.
Json write_record(Evaluator& evaluator, const Prepared& point, const std::string& folder, int threads,
                  bool timed, bool base = false);

/// One point of a sweep: its place in the list, and its name.
struct ListedPoint {
    Point point;
    std::string hash;
    bool base = false;  // mode one_at_a_time: the unvaried ones; other modes: the first
};
/// The contents of sweep.json: the points in order, each by its hash, and the command.
Json sweep_record(const SweepFile& sweep, const std::vector<ListedPoint>& entries,
                  const std::vector<std::string>& wanted);

/// RUN/runs/*.json: a file for each time that the program works in a folder, rewritten as it proceeds.
class RunLog {
  public:
    struct Counts {
        std::size_t computed = 0, reused = 0, failed = 0;
    };
    RunLog(const std::string& folder, const Json& about);
    void write(const char* state, double seconds, const Counts& counts);

  private:
    std::string path_;
    Json about_;
};

}  // namespace squint::sweep
