#include "studies/search/tried_pictures.h"

#include "core/parallel.h"
#include "pipeline/render.h"
#include "scene/toml.h"
#include "studies/sweep/run.h"
#include "studies/sweep/side_by_side.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace squint::search {

using namespace squint::sweep;

TriedPictures::TriedPictures(const Settings& settings, const SweepFile& sweep, Scenes& scenes,
                             const Variables& variables)
    : s_(settings),
      sweep_(sweep),
      scenes_(scenes),
      variables_(variables),
      threads_(threads_for(settings.threads)),
      wanted_(scenes.evaluator().wanted()) {}

void TriedPictures::add_views() {
    for (int k = 0; k < s_.views; ++k) add_view(k, s_.views, false);
}

int TriedPictures::held_out_a_set(const Settings& settings) {
    constexpr int kLeast = 16;
    return std::max(kLeast, settings.views);
}

// Evenly spaced, at turns that no other set has: the golden section of a gap further on each.
void TriedPictures::hold_out() {
    constexpr int kGap = 1000;
    const int n = held_out_a_set(s_), first = (309 + 618 * sets_++) % kGap;
    let_all_decide();
    for (int i = 0; i < n; ++i) add_view(kGap * i + first, kGap * n, true);
}

void TriedPictures::let_all_decide() {
    for (View& view : views_) view.held_out = false;
}

void TriedPictures::add_view(int frame, int grid, bool held_out) {
    View view{360.0 * frame / grid, held_out, {}};
    for (std::size_t i = 0; i < scenes_.count(); ++i) view.overrides.push_back(turned(i, frame, grid));
    views_.push_back(std::move(view));
}

std::vector<std::string> TriedPictures::turned(std::size_t scene, int frame, int grid) {
    if (frame == 0) return {};
    Point point;
    point.scene = scene;
    const Prepared p = scenes_.prepared(point);
    CameraSettings settings = p.scene.camera;
    settings.turntable = grid;
    const Camera camera = make_camera(settings, *p.volume, p.scene.image.width, p.scene.image.height, frame);
    const auto vector = [](const char* key, const Vec3& v) {
        return fmt::format("camera.{}=[{}, {}, {}]", key, toml_text(v.x), toml_text(v.y), toml_text(v.z));
    };
    return {vector("eye", camera.eye), vector("center", camera.center), vector("up", camera.up)};
}

std::vector<Picture> TriedPictures::pictures(const Point& formats, const Reason& reason,
                                             bool held_out) const {
    std::vector<Picture> all;
    for (std::size_t scene = 0; scene < scenes_.count(); ++scene)
        for (const View& view : views_) {
            if (view.held_out != held_out) continue;
            Picture picture;
            Point& point = picture.entry.point = formats;
            point.scene = picture.scene = scene;
            point.overrides.insert(point.overrides.end(), view.overrides[scene].begin(),
                                   view.overrides[scene].end());
            // Wires that this scene does not use keep their Spec, so that its points keep their names.
            std::erase_if(point.edits,
                          [&](const WireEdit& edit) { return !variables_.uses(scene, edit.wire); });
            const auto text = [](std::string_view value) { return toml_text(value); };
            point.values = {{"phase", text(reason.phase)},
                            {"restart", toml_text(std::int64_t{reason.restart})}};
            if (scenes_.count() > 1) point.values.emplace_back("scene", text(scenes_.name(scene)));
            point.values.emplace_back("degrees", toml_text(view.degrees));
            if (!reason.varied.first.empty())
                point.values.push_back(reason.varied), point.varied = reason.varied.first;
            all.push_back(std::move(picture));
        }
    return all;
}

std::vector<Json> TriedPictures::records(std::vector<Picture>& pictures) {
    Evaluator& evaluator = scenes_.evaluator();
    const bool timed = s_.cost == CostKind::time;
    const auto check = [&] {
        if (s_.cancelled && *s_.cancelled) throw Cancelled{};
    };
    side_by_side(pictures.size(), threads_, [&](std::size_t i) {
        check();
        pictures[i].prepared = evaluator.prepare(pictures[i].entry.point);
        pictures[i].entry.hash = pictures[i].prepared.hash;
    });
    std::map<std::string, std::size_t> first;
    for (std::size_t i = 0; i < pictures.size(); ++i) {
        entries_.push_back(pictures[i].entry);
        first.emplace(pictures[i].entry.hash, i);
    }
    std::vector<std::size_t> fresh;
    for (const auto& [hash, i] : first)
        if (!records_.contains(hash)) fresh.push_back(i);
    for (const std::size_t i : fresh)  // one after the other, each on all threads
        if (pictures[i].prepared.failure.empty()) evaluator.make_baselines(pictures[i].prepared, threads_);
    side_by_side(fresh.size(), timed ? 1 : threads_, [&](std::size_t n) {
        check();
        const Picture& picture = pictures[fresh[n]];
        const std::string& hash = picture.entry.hash;
        const std::string path = point_path(s_.folder, hash);
        const RecordState state = state_of(path, wanted_);
        const bool there = state != RecordState::missing;
        Json record = there
                          ? read_json(path)
                          : write_record(evaluator, picture.prepared, s_.folder, timed ? threads_ : 1, timed);
        const std::lock_guard lock(mutex_);
        ++counts_.pictures, counts_.computed += !there, counts_.failed += record["status"] != "done";
        counts_.other_program += state == RecordState::other_program;
        records_.emplace(hash, std::move(record));
    });
    std::vector<Json> out;
    for (const Picture& picture : pictures) out.push_back(records_.at(picture.entry.hash));
    return out;
}

Summary TriedPictures::summary(std::span<const Picture> pictures, std::span<const Json> records) const {
    Summary sum;
    double squares = 0, table_bits = 0, worst = 0;
    const auto n = static_cast<double>(records.size());
    for (std::size_t i = 0; i < records.size(); ++i) {
        const Json& record = records[i];
        if (record["status"] != "done") {
            sum.failure = fmt::format("{}: {}", scenes_.name(pictures[i].scene), record.value("reason", ""));
            return sum;
        }
        const Json& error = record["error"]["real"];
        for (const char* channel : {s_.srgb ? "color_srgb" : "color", "alpha"}) {
            const double rms = error[channel]["rmse_lsb8"];
            const double figure =
                s_.figure == Figure::rms ? rms : error[channel]["max_error_lsb8"].get<double>();
            worst = std::max(worst, figure), squares += rms * rms / (2 * n);
        }
        const Json& cost = record["cost"];
        sum.bits += cost["bits"].get<double>() / n;
        sum.table_bytes += cost["table_bytes"].get<double>() / n;
        table_bits += cost["table_bits"].get<double>() / n;
        if (record.contains("time")) sum.ms += record["time"]["ms"].get<double>() / n;
    }
    // A largest error counts with the mean square, as if it were four times its root.
    const double penalty = s_.figure == Figure::rms ? squares : squares + worst * worst / 16;
    sum.trial = {worst, penalty, sum.bits, sum.bits};
    if (s_.cost == CostKind::table_bytes)
        sum.trial.cost = sum.table_bytes, sum.trial.bits += 1e6 * table_bits;
    // Times within a twentieth count as equal: repeats differ by as much.
    if (s_.cost == CostKind::time) sum.trial.cost = std::floor(std::log(sum.ms) / std::log(1.05));
    return sum;
}

}  // namespace squint::search
