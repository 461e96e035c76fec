// Sessions read, joined, refined, written.
#include <lamina/pipeline/refine_sessions.hpp>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <limits>
#include <optional>
#include <set>

#include <lamina/backend/merging/map_alignment.hpp>
#include <lamina/backend/refine/refiner.hpp>
#include <lamina/io/figure_names.hpp>
#include <lamina/io/session.hpp>
#include <lamina/models/error.hpp>
#include <lamina/pipeline/calibration/log.hpp>
#include <lamina/pipeline/extrinsics_refinement.hpp>
#include <lamina/pipeline/map_result.hpp>

namespace lamina {
namespace {

using Path = std::filesystem::path;

Path session_file(const Path& input) {
  if (!std::filesystem::exists(input)) {
    throw Error(input.string() +
                ": found no such file or folder, expected an output folder of `map` with its "
                "session.lamina");
  }
  if (!std::filesystem::is_directory(input)) return input;
  const Path file = input / "session.lamina";
  if (std::filesystem::exists(file)) return file;
  throw Error(input.string() + ": found no session.lamina, expected an output folder of `map`");
}

// Paths are told apart by time: a session that does not begin after all others is moved to begin
// ten seconds after them.
void make_later(io::Session& session, const io::Session& than) {
  std::int64_t first = std::numeric_limits<std::int64_t>::max(), last = 0;
  for (const auto& part : session.parts) first = std::min(first, part.first.nanoseconds());
  for (const auto& part : than.parts) last = std::max(last, part.last.nanoseconds());
  if (session.parts.empty() || first > last) return;
  const std::int64_t shift = (last - first) / 1'000'000'000 + 10;
  session.shift_time(shift * 1'000'000'000);
  run_log().info("{}: begins before the others end; its stamps are {} s later in the joined files",
                 session.parts.front().name, shift);
}

// Where rays of its scans went, those made from depth included. A scan every 0.3 m or 20 degrees
// and a beam every degree or so tell what is free.
FreeSpace free_space(const io::Session& session) {
  std::map<std::int64_t, SE3> poses;
  std::map<KeyframeId, SE3> keyframes;
  for (const Keyframe& k : session.map.graph.keyframes) keyframes[k.id] = k.T_map_body;
  for (const MapFrame& f : session.map.frames) {
    poses.try_emplace(f.stamp.nanoseconds(), keyframes.at(f.keyframe) * f.T_keyframe_body);
  }
  FreeSpace free;
  std::map<bool, SE3> last;
  for (const KeptScan& kept : session.scans) {
    const auto pose = poses.find(kept.scan.stamp.nanoseconds());
    if (pose == poses.end()) continue;
    const auto before = last.find(kept.from_depth);
    if (before != last.end()) {
      const SE3 moved = before->second.inverse() * pose->second;
      if (moved.translation().norm() < 0.3 && moved.so3().log().norm() < 0.35) continue;
    }
    last[kept.from_depth] = pose->second;
    const SE3 T_map_lidar = pose->second * kept.scan.lidar.T_body_lidar;
    const std::size_t every = 1 + kept.scan.size() / 360;
    for (std::size_t i = 0; i < kept.scan.size(); i += every) {
      if (!kept.scan.valid(i)) continue;
      const Eigen::Vector2d p = kept.scan.point(i);
      free.add_ray(T_map_lidar.translation(), T_map_lidar * Eigen::Vector3d(p.x(), p.y(), 0));
    }
  }
  return free;
}

// The same recording twice would count as twice the evidence.
void require_another(const io::Session& map, const io::Session& more, const Path& second) {
  for (const auto& a : map.parts) {
    for (const auto& b : more.parts) {
      const bool same = a.name == b.name &&
                        a.first.nanoseconds() - a.shift_ns == b.first.nanoseconds() - b.shift_ns &&
                        a.last.nanoseconds() - a.shift_ns == b.last.nanoseconds() - b.shift_ns;
      if (!same) continue;
      throw Error(second.string() + ": found the recording " + b.name +
                  " a second time, expected sessions of different recordings");
    }
  }
}

// A session that went into the map, for the check afterwards.
struct Joined {
  Path name;
  KeyframeId first = KeyframeId::kNone, end = KeyframeId::kNone;  // its keyframes
  std::set<PlaneId> shared;                                       // planes of the map
};

// Nothing where its place is not found; `why` then says what was.
std::optional<Joined> join(io::Session& map, io::Session& more, const Path& second,
                           std::string& why) {
  const OverlapResult found = find_overlap(map.map, more.map, free_space(map), free_space(more));
  if (!found.overlap) {
    why = found.reason;
    return std::nullopt;
  }
  const SE3& T = found.overlap->T_a_b;
  run_log().info(
      "{}: joined by {} planes and {:.0f} m of wall (evidence {:.0f}, needed {:.0f}), moved by "
      "{:.2f} m and {:.1f} degrees",
      second.string(), found.overlap->planes.size(), found.wall_m, found.evidence, found.needed,
      T.translation().norm(), T.so3().log().norm() * 180 / M_PI);
  if (found.kept_frame) {
    run_log().warn("{}: another place fits nearly as well; taken is the one that keeps its frame",
                   second.string());
  }
  make_later(more, map);
  Joined joined{second, static_cast<KeyframeId>(map.map.graph.next_keyframe), {}, {}};
  append(map.map, more.map, *found.overlap);
  joined.end = static_cast<KeyframeId>(map.map.graph.next_keyframe);
  for (const auto& [of_b, of_a] : found.overlap->planes) joined.shared.insert(of_a);
  const auto extend = [](auto& to, const auto& from) {
    to.insert(to.end(), from.begin(), from.end());
  };
  extend(map.parts, more.parts);
  extend(map.scans, more.scans);
  extend(map.rims, more.rims);
  extend(map.ground, more.ground);
  extend(map.sights, more.sights);
  io::add(map.counts, more.counts);
  for (const auto& [why_skipped, count] : more.skipped) map.skipped[why_skipped] += count;
  map.counts.joined_planes += static_cast<double>(found.overlap->planes.size());
  return joined;
}

// In whatever order they fit: one that meets the first only by way of another waits for it.
std::vector<Joined> join_all(io::Session& map, const std::vector<Path>& inputs) {
  std::vector<std::pair<Path, io::Session>> waiting;
  for (std::size_t i = 1; i < inputs.size(); ++i) {
    waiting.emplace_back(inputs[i], io::read_session(session_file(inputs[i])));
    require_another(map, waiting.back().second, inputs[i]);
    for (std::size_t j = 0; j + 1 < waiting.size(); ++j) {
      require_another(waiting[j].second, waiting.back().second, inputs[i]);
    }
  }
  std::vector<Joined> result;
  while (!waiting.empty()) {
    std::string first_reason;
    const auto placed = std::find_if(waiting.begin(), waiting.end(), [&](auto& more) {
      std::string why;
      const auto joined = join(map, more.second, more.first, why);
      if (joined) result.push_back(*joined);
      if (first_reason.empty()) first_reason = why;
      return joined.has_value();
    });
    if (placed == waiting.end()) {
      throw Error(waiting.front().first.string() + ": found no place for it in " +
                  inputs.front().string() + (result.empty() ? "" : " and those joined to it") +
                  " (" + first_reason + "), expected maps that share walls enough to tell where");
    }
    waiting.erase(placed);
  }
  return result;
}

// Planes that are not one are taken apart by the refiner: where that happened to most of what tied
// a session to the others, its place was wrong.
void require_held(const Joined& joined, const Graph& graph) {
  std::set<PlaneId> shared;
  for (PlaneId id : joined.shared) {
    while (graph.find(id) != nullptr && graph.at(id).merged_into != PlaneId::kNone) {
      id = graph.at(id).merged_into;
    }
    shared.insert(id);
  }
  std::size_t views = 0, held = 0;
  for (const PlaneMomentsFactor& f : graph.plane_moments) {
    if (f.keyframe < joined.first || f.keyframe >= joined.end) continue;
    const bool from_shared = shared.count(f.plane) > 0;
    views += from_shared;
    held += from_shared && f.weight > 0.5;
  }
  if (views == 0 || 2 * held < views) {
    throw Error(fmt::format(
        "{}: found that its place does not hold: the refined map accepts {} of its {} views of "
        "shared planes, expected at least half",
        joined.name.string(), held, views));
  }
}

}  // namespace

MapResult refine_sessions(const std::vector<Path>& inputs, const OptionsOfText& options_of,
                          const Path& scratch_folder, RunObserver& observer) {
  io::Session session = io::read_session(session_file(inputs.front()));
  MapOptions options = options_of(session.settings, inputs.front().string());
  options.scratch_folder = scratch_folder;
  const std::vector<Joined> joined = join_all(session, inputs);
  observer.on_first_step();
  MapResult result{"", options, Mapper(options.mapper),
                   std::make_shared<RunRecord>(scratch_folder)};
  for (const Path& input : inputs) result.sessions.push_back(session_file(input));
  if (options.refine_extrinsics && !observer.hurried())
    refine_extrinsics(session, options, result.diagnostics(), [&] { return observer.hurried(); });
  result.record->take(session);
  result.diagnostics().input = inputs.front().string();
  result.diagnostics().command = options.command;
  result.mapper = Mapper(options.mapper, std::move(session.map));
  Mapper& mapper = result.mapper;
  const Trajectory before = mapper.trajectory();
  const RefineResult refined =
      mapper.refine({}, [&](const RefineProgress&) { return !observer.hurried(); });
  result.stopped = observer.hurried();
  if (!result.stopped) {
    for (const Joined& j : joined) require_held(j, mapper.graph());
    mapper.know_covariances();
  }
  result.record->set_refinement(refined, before, mapper.trajectory());
  if (!result.stopped && refined.status != SolveStatus::kConverged)
    run_log().warn("refinement: {}", to_string(refined.status));
  result.map = mapper.map();
  result.trajectory = mapper.trajectory();
  finish_map(result, observer);
  if (result.stopped)
    result.diagnostics().warn("interrupted",
                              "interrupted: the map is refined and drawn in part; the same command "
                              "begins anew");
  return result;
}

}  // namespace lamina
