// Sessions read, joined, refined, written.
#include <lamina/apps/refine_session.hpp>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <lamina/apps/map_output.hpp>
#include <lamina/apps/mapping.hpp>
#include <lamina/backend/map_overlap.hpp>
#include <lamina/io/atomic_file.hpp>
#include <lamina/io/session.hpp>
#include <lamina/models/error.hpp>

namespace lamina::apps {
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

// Paths are told apart by time: a recording that overlaps an earlier one is moved to begin ten
// seconds after it.
void make_later(io::Session& session, const io::Session& than) {
  std::int64_t last = 0;
  for (const auto& part : than.parts) last = std::max(last, part.last.nanoseconds());
  for (const auto& part : session.parts) {
    if (part.first.nanoseconds() > last) continue;
    const std::int64_t shift = (last - part.first.nanoseconds()) / 1'000'000'000 + 10;
    session.shift_time(shift * 1'000'000'000);
    spdlog::info("{}: overlaps in time; its stamps are {} s later in the joined files", part.name,
                 shift);
    return;
  }
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

void join(io::Session& map, io::Session more, const Path& first, const Path& second) {
  require_another(map, more, second);
  const OverlapResult found = find_overlap(map.map, more.map);
  if (!found.overlap) {
    throw Error(second.string() + ": found no place for it in " + first.string() + " (" +
                found.reason + fmt::format(", {:.1f} m^2 seen by both", found.shared_m2) +
                "), expected maps that share walls and floor");
  }
  const SE3& T = found.overlap->T_a_b;
  spdlog::info("{}: joined by {} planes and {:.0f} m^2, moved by {:.2f} m and {:.1f} degrees",
               second.string(), found.overlap->planes.size(), found.shared_m2,
               T.translation().norm(), T.so3().log().norm() * 180 / M_PI);
  if (found.rival_share > OverlapOptions().max_rival_share) {
    spdlog::warn("{}: another place fits nearly as well; taken is the one that keeps its frame",
                 second.string());
  }
  make_later(more, map);
  append(map.map, more.map, *found.overlap);
  const auto extend = [](auto& to, const auto& from) {
    to.insert(to.end(), from.begin(), from.end());
  };
  extend(map.parts, more.parts);
  extend(map.scans, more.scans);
  extend(map.rims, more.rims);
  for (const auto& [name, count] : more.counts) map.counts[name] += count;
  for (const auto& [why, count] : more.skipped) map.skipped[why] += count;
  map.counts["joined_planes"] += static_cast<double>(found.overlap->planes.size());
}

Settings settings_in(const io::Session& session, const Path& file) {
  Settings settings;
  load_text(settings, session.settings, file.string());
  return settings;
}

}  // namespace

int refine_sessions(const std::vector<Path>& inputs, const Path& output_folder, bool quiet) {
  set_up_log(quiet);
  io::Session session = io::read_session(session_file(inputs.front()));
  const Settings settings = settings_in(session, inputs.front());
  for (std::size_t i = 1; i < inputs.size(); ++i) {
    join(session, io::read_session(session_file(inputs[i])), inputs.front(), inputs[i]);
  }
  io::make_results_folder(output_folder);
  MapOutput output(output_folder, settings);
  output.take(session);
  Mapper mapper(settings.mapper, std::move(session.map));
  const Trajectory before = mapper.trajectory();
  const RefineResult result = mapper.refine();
  mapper.know_covariances();
  output.set_refinement(result, before, mapper.trajectory());
  if (result.status != SolveStatus::kConverged) {
    spdlog::warn("refinement: {}", to_string(result.status));
  }
  output.write(mapper, false);
  fmt::print("{}", output.summary());
  return 0;
}

}  // namespace lamina::apps
