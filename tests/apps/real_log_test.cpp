// A real log of a level scanner through the program: what its map must not hold.
#include "program.hpp"

#include <nlohmann/json.hpp>

namespace lamina {
namespace {

using namespace program;

// A plane of a level scanner that tilts fits more lines the flatter it lies, all of them in the
// end.
TEST(RealLog, WallsOfALevelScannerStayUpright) {
  const Path log =
      "/usr/share/mrpt/datasets/2006-01ENE-21-SENA_Telecom Faculty_one_loop_only.rawlog";
  if (!std::filesystem::exists(log)) GTEST_SKIP() << log << " is absent (mrpt-common)";
  const Path map = scratch() / "sena";
  ASSERT_EQ(run({"map", log, "--output", map, "--quiet"}), 0);
  const auto planes = nlohmann::json::parse(text_of(map / "planes.json")).at("planes");
  ASSERT_GT(planes.size(), 20u);
  for (const auto& plane : planes) {
    EXPECT_LT(std::abs(plane.at("normal").at(2).get<double>()), 0.5) << plane.at("id");
  }
}

}  // namespace
}  // namespace lamina
