// Maps of a scanner by either form of a partial view, by either engine.
#include <lamina/pipeline/evaluation/evaluation.hpp>

#include "pipeline/faulty_room.hpp"
#include "pipeline/run_map.hpp"

namespace lamina {
namespace {

TEST(PartialView, EitherFormMapsARoomAsWellByEitherEngine) {
  const Folder folder;
  sim::DatasetOptions options;
  options.grid = false;
  sim::write_dataset(
      sim::make_scene("room", {{"lidar.enabled", "true"}, {"camera.enabled", "false"}}),
      folder.path() / "data", options);
  std::map<std::string, double> ate;
  for (const std::string form : {"moments", "end_points"}) {
    for (const std::string engine : {"native", "ceres"}) {
      MapRequest request;
      request.input = (folder.path() / "data").string();
      request.output = folder.path() / (form + engine);
      request.assignments = {"lidar.partial_view=" + form, "solver.engine=" + engine};
      ASSERT_TRUE(run_map(request)) << form << engine;
      const auto evaluated = evaluate(request.output, folder.path() / "data");
      ASSERT_TRUE(evaluated.trajectory) << form << engine;
      ate[form + engine] = evaluated.trajectory->ate_m.rmse;
    }
  }
  const double usual = ate["momentsnative"];
  EXPECT_LT(usual, 0.01);
  for (const auto& [name, error] : ate) EXPECT_NEAR(error, usual, 0.2 * usual + 0.001) << name;
  // They are not one and the same.
  EXPECT_NE(ate["end_pointsnative"], usual);
}

}  // namespace
}  // namespace lamina
