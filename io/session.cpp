// Sessions to bytes and back.
#include <lamina/io/session.hpp>

#include <stdexcept>

#include <lamina/backend/mapper/map_archive.hpp>
#include <lamina/io/sealed_file.hpp>
#include <lamina/io/session_archive.hpp>
#include <lamina/models/error.hpp>

namespace lamina::io {
namespace {

constexpr SealedKind kKind{"LAMINASN", 8, "a session.lamina of `lamina map`"};

}  // namespace

template <class A>
void fields(A& a, Session& v) {
  a(v.settings, v.online, v.parts, v.map, v.scans, v.rims, v.ground, v.sights, v.before, v.counts,
    v.skipped);
}

std::string session_content(const Session& session) {
  ArchiveWriter archive;
  archive(session);
  return archive.bytes();
}

void write_session(const std::filesystem::path& file, const Session& session) {
  write_sealed(file, kKind, [&](const ArchiveWriter::Put& put) {
    ArchiveWriter archive(put);
    archive(session);
    archive.flush();
  });
}

// The members in the order of fields(Session), the lists item by item.
void write_session(const std::filesystem::path& file, const Session& session,
                   const SessionLists& lists) {
  LAMINA_CHECK(session.scans.empty() && session.rims.empty() && session.ground.empty() &&
               session.sights.empty());
  write_sealed(file, kKind, [&](const ArchiveWriter::Put& put) {
    ArchiveWriter archive(put);
    archive(session.settings, session.online, session.parts, session.map);
    for (const Spool* list : {&lists.scans, &lists.rims, &lists.ground, &lists.sights}) {
      archive(list->size());
      archive.flush();
      list->for_each(put);
    }
    archive(session.before, session.counts, session.skipped);
    archive.flush();
  });
}

Session read_session(const std::filesystem::path& file) {
  return parse_session(read_sealed(file, kKind), file.string());
}

Session parse_session(std::string_view content, const std::string& name) {
  Session session;
  try {
    ArchiveReader archive(content);
    archive(session);
    if (!archive.at_end()) throw std::out_of_range("bytes are left over");
  } catch (const std::exception& error) {
    throw Error(name + ": found content that makes no sense (" + error.what() + "), expected " +
                std::string(kKind.name));
  }
  const auto problems = session.map.problems();
  if (!problems.empty()) {
    throw Error(name + ": found a broken map (" + problems.front() + "), expected " +
                std::string(kKind.name));
  }
  return session;
}

void Session::shift_time(std::int64_t nanoseconds) {
  const auto shift = [nanoseconds](Timestamp& t) {
    t = Timestamp::from_nanoseconds(t.nanoseconds() + nanoseconds);
  };
  for (SessionPart& part : parts) {
    shift(part.first);
    shift(part.last);
    part.shift_ns += nanoseconds;
  }
  for (Keyframe& keyframe : map.graph.keyframes) shift(keyframe.stamp);
  for (PlaneLandmark& plane : map.graph.planes) {
    shift(plane.first_seen);
    shift(plane.last_seen);
  }
  for (MapFrame& frame : map.frames) shift(frame.stamp);
  for (KeptScan& kept : scans) shift(kept.scan.stamp);
  for (SeenRims& seen : rims) shift(seen.stamp);
  for (SeenGround& seen : ground) shift(seen.stamp);
  for (SeenDepth& seen : sights) shift(seen.stamp);
  Trajectory moved;
  for (const StampedPose& p : before) {
    moved.add(Timestamp::from_nanoseconds(p.stamp.nanoseconds() + nanoseconds), p.pose);
  }
  before = std::move(moved);
}

}  // namespace lamina::io
