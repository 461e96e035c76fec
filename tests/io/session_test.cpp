// session.lamina: round trip, and one line for every way a file can be wrong.
#include <lamina/io/session_archive.hpp>

#include <gtest/gtest.h>

#include <fstream>
#include <limits>
#include <sstream>

#include <lamina/io/sealed_file.hpp>
#include <lamina/models/error.hpp>

namespace lamina::io {
namespace {

std::filesystem::path file_for_test() {
  const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
  return std::filesystem::path(::testing::TempDir()) / (std::string(info->name()) + ".lamina");
}

Session small_session() {
  Session session;
  session.settings = "seed: 3\n";
  session.parts = {{"a.log", Timestamp::from_seconds(1), Timestamp::from_seconds(2), 0}};
  MapState& map = session.map;
  const KeyframeId id = map.graph.add_keyframe(Timestamp::from_seconds(1), SE3::planar(1, 2, 3));
  map.frames = {{Timestamp::from_seconds(1), id, SE3()},
                {Timestamp::from_seconds(2), id, SE3::planar(0.1, 0, 0)}};
  PlaneLandmark plane = PlaneLandmark::at(Plane({0.6, 0, 0.8}, 2), {1, 1, 1});
  plane.outline.add_stroke({0, 0}, {1, 1});
  const PlaneId wall = map.graph.add_plane(plane);
  Moments moments;
  moments.add({1, 2, 3}, 4);
  const ExtrinsicsId camera =
      map.graph.add_extrinsics(Extrinsics::at("depth_camera", SE3::planar(0.1, 0.2, 0.3)));
  map.graph.plane_moments.push_back(
      {id, wall, moments, ExtrinsicsId::kNone, 0.5, {{camera, moments}}});
  map.outlines[wall] = {{id, {{1, 2, 3}, {4, 5, 6}}}};
  map.surfels.add(id, moments);
  LaserScan scan;
  scan.stamp = Timestamp::from_seconds(1);
  scan.ranges = {1.0F, 2.0F};
  session.scans = {{scan, true}};
  session.rims = {{scan.stamp, SE3(), 0, 0.1, {1.0F}, {{{1, 2, 3}, 0.1, true}}}};
  GroundLook look;
  look.nx = look.ny = 4;
  look.floor_bits = {5, 6};
  look.marks = {{{1, 2}, 0.03F, 0.002F}};
  session.ground = {{scan.stamp, SE3(), look}};
  DepthLook depth;
  depth.nx = depth.ny = 1;
  depth.reach = {7};
  session.sights = {{scan.stamp, SE3(), depth}};
  session.before.add(scan.stamp, SE3());
  session.counts.steps = 2;
  session.skipped["missing file"] = 1;
  return session;
}

std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

void put(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary) << bytes;
}

std::string complaint(const std::filesystem::path& file) {
  try {
    read_session(file);
  } catch (const Error& error) {
    return error.what();
  }
  return "none";
}

TEST(Session, WrittenItemByItemItIsTheSame) {
  const auto file = file_for_test();
  Session session = small_session();
  write_session(file, session);
  const std::string whole = bytes_of(file);
  Spool scans, rims, ground, sights;
  const auto put_aside = [](Spool& spool, const auto& items) {
    for (const auto& item : items) {
      ArchiveWriter archive;
      archive(item);
      spool.add(archive.bytes());
    }
  };
  put_aside(scans, session.scans);
  put_aside(rims, session.rims);
  put_aside(ground, session.ground);
  put_aside(sights, session.sights);
  session.scans.clear();
  session.rims.clear();
  session.ground.clear();
  session.sights.clear();
  write_session(file, session, {scans, rims, ground, sights});
  EXPECT_EQ(bytes_of(file), whole);
}

TEST(Session, ComesBackAndIsWrittenTheSame) {
  const auto file = file_for_test();
  write_session(file, small_session());
  const Session back = read_session(file);
  EXPECT_EQ(back.settings, "seed: 3\n");
  ASSERT_EQ(back.map.graph.planes.size(), 1u);
  EXPECT_EQ(back.map.graph.plane_moments[0].weight, 0.5);
  EXPECT_EQ(back.map.frames.size(), 2u);
  EXPECT_EQ(back.scans[0].scan.ranges.size(), 2u);
  EXPECT_EQ(back.rims[0].rims_levelled[0].sigma, 0.1);
  EXPECT_EQ(back.ground[0].look.floor_bits, (std::vector<std::uint8_t>{5, 6}));
  EXPECT_EQ(back.ground[0].look.marks[0].height, 0.03F);
  EXPECT_EQ(back.sights[0].look.reach, (std::vector<std::uint8_t>{7}));
  EXPECT_EQ(back.skipped.at("missing file"), 1);
  const std::string first = bytes_of(file);
  write_session(file, back);
  EXPECT_EQ(bytes_of(file), first);
}

TEST(Session, SaysWhatIsWrong) {
  const auto file = file_for_test();
  write_session(file, small_session());
  const std::string good = bytes_of(file);
  const std::string name = file.string();
  EXPECT_EQ(complaint("/nowhere/session.lamina"),
            "/nowhere/session.lamina: cannot be opened, expected a session.lamina of `lamina map`");
  put(file, "hello");
  EXPECT_EQ(complaint(file),
            name + ": found another kind of file, expected a session.lamina of `lamina map`");
  std::string other = good;
  other[8] = 9;
  put(file, other);
  EXPECT_EQ(complaint(file),
            name + ": found version 9, expected version 8: it was made by another lamina");
  put(file, good.substr(0, good.size() - 1));
  EXPECT_NE(complaint(file).find("it was cut short"), std::string::npos);
  std::string damaged = good;
  damaged[good.size() / 2] = static_cast<char>(damaged[good.size() / 2] ^ 1);
  put(file, damaged);
  EXPECT_EQ(complaint(file),
            name +
                ": found damaged content (its checksum differs), expected a session.lamina of "
                "`lamina map`");
}

TEST(Session, ContentThatLiesIsRefused) {
  const auto file = file_for_test();
  constexpr SealedKind kKind{"LAMINASN", 8, "x"};
  write_sealed(file, kKind, std::string(64, '\xff'));
  EXPECT_NE(complaint(file).find("makes no sense"), std::string::npos);
  Session broken = small_session();
  broken.map.frames[0].keyframe = static_cast<KeyframeId>(77);
  write_session(file, broken);
  EXPECT_NE(complaint(file).find("a frame hangs on a keyframe that is not there"),
            std::string::npos);
}

TEST(Session, IdsThatWouldOverflowAreRefused) {
  const auto file = file_for_test();
  Session broken = small_session();
  broken.map.graph.next_keyframe = std::numeric_limits<std::int64_t>::max();
  write_session(file, broken);
  EXPECT_NE(complaint(file).find("next id beyond all use"), std::string::npos);
}

TEST(Session, ShiftMovesEveryStamp) {
  Session session = small_session();
  session.shift_time(5'000'000'000);
  EXPECT_EQ(session.map.frames[1].stamp, Timestamp::from_seconds(7));
  EXPECT_EQ(session.map.graph.keyframes[0].stamp, Timestamp::from_seconds(6));
  EXPECT_EQ(session.scans[0].scan.stamp, Timestamp::from_seconds(6));
  EXPECT_EQ(session.rims[0].stamp, Timestamp::from_seconds(6));
  EXPECT_EQ(session.before[0].stamp, Timestamp::from_seconds(6));
  EXPECT_EQ(session.parts[0].shift_ns, 5'000'000'000);
}

}  // namespace
}  // namespace lamina::io
