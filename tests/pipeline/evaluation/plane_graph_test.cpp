// Reading and writing benchmark problems.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <lamina/models/error.hpp>
#include <lamina/pipeline/evaluation/plane_graph.hpp>

namespace lamina {
namespace {

constexpr const char* kSmall =
    "# two poses, one plane\n"
    "SIG 0.01 0.002 0.02\n"
    "GT 0 0 0 0 1 0 0 0\nGT 1 0 0 0 1 1 0 0\n"
    "INIT 0 0 0 0 1 0 0 0\nINIT 1 0 0 0 1 1.1 0 0\n"
    "PLANE 0 0 0 1 -1\n"
    "ODO 0 1 0 0 0 1 1 0 0\n"
    "OBS 1 0 4 0 0 0 9 0 0 30 -30 30\n";

std::string message(const std::string& text) {
  try {
    parse_plane_graph(text, "x.planegraph");
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(PlaneGraph, ReadsEveryRecord) {
  const PlaneGraph problem = parse_plane_graph(kSmall, "x");
  EXPECT_EQ(problem.initial_map_body.size(), 2u);
  EXPECT_EQ(problem.plane_count, 1);
  EXPECT_DOUBLE_EQ(problem.sigma_point, 0.02);
  ASSERT_EQ(problem.observations.size(), 1u);
  const Moments& moments = problem.observations[0].moments_body;
  EXPECT_EQ(moments.count(), 30);
  EXPECT_DOUBLE_EQ(moments.mean().z(), -1);
  EXPECT_DOUBLE_EQ(moments.scatter()(1, 1), 9);
}

TEST(PlaneGraph, RoundTrip) {
  const PlaneGraph problem = parse_plane_graph(kSmall, "x");
  const auto file = std::filesystem::temp_directory_path() /
                    ("lamina_plane_graph_" + std::to_string(getpid()) + ".planegraph");
  write_plane_graph(problem, file);
  const PlaneGraph again = read_plane_graph(file);
  std::filesystem::remove(file);
  EXPECT_EQ(again.odometry.size(), 1u);
  EXPECT_DOUBLE_EQ(again.truth_planes[0].rho(), -1);
  EXPECT_EQ(again.observations[0].moments_body.scatter(),
            problem.observations[0].moments_body.scatter());
}

TEST(PlaneGraph, ErrorsNameFileLineFoundAndExpected) {
  EXPECT_EQ(message("INIT 0 0 0 0 1 0 0 0\nFOO 1\n"),
            "x.planegraph:2: found 'FOO', expected SIG, GT, INIT, PLANE, ODO or OBS");
  EXPECT_EQ(message("INIT 1 0 0 0 1 0 0 0\n"),
            "x.planegraph:1: found '1', expected INIT 0 (indices count up from 0)");
  EXPECT_EQ(message("INIT 0 0 0 0 1 0 0\n"),
            "x.planegraph:1: found the end of the line, expected a translation tx ty tz");
  EXPECT_EQ(message("INIT 0 0 0 0 1 0 0 nan\n"),
            "x.planegraph:1: found 'nan', expected a translation tx ty tz");
  EXPECT_EQ(message("INIT 0 0 0 0 1 0 0 0 9\n"),
            "x.planegraph:1: found '9', expected the end of the line");
  EXPECT_EQ(message("INIT 0 0 0 0 1 0 0 0\nODO 0 4 0 0 0 1 1 0 0\n"),
            "x.planegraph: found an ODO record of pose 4, expected an INIT record for it "
            "(there are 1)");
  EXPECT_EQ(message(""), "x.planegraph: found no INIT record, expected at least one pose");
  EXPECT_THAT(message("INIT 0 0 0 0 2 0 0 0\n"), testing::HasSubstr("length 2.0"));
  EXPECT_THAT(message("INIT 0 0 0 0 1 0 0 0\nOBS 0 0 1 0 0 0 1 0 0 1 0 0\n"),
              testing::HasSubstr("expected a positive weight"));
}

}  // namespace
}  // namespace lamina
