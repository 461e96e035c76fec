// What mapping a spoilt recording comes to.
#include "pipeline/faulty_room.hpp"

#include <nlohmann/json.hpp>

#include <lamina/pipeline/evaluation/evaluation.hpp>
#include "pipeline/run_map.hpp"

namespace lamina {

Outcome map_and_evaluate(const Folder& folder, const fs::path& data) {
  MapRequest request;
  request.input = data.string();
  request.output = folder.path() / "map";
  EXPECT_TRUE(run_map(request));
  const Evaluation evaluation = evaluate(request.output, data);
  std::ifstream in(request.output / "metrics.json");
  const auto metrics = nlohmann::json::parse(in);
  Outcome outcome;
  outcome.ate = evaluation.trajectory->ate_m.rmse;
  outcome.poses = evaluation.trajectory->matched;
  outcome.spurious = evaluation.planes->spurious.size();
  outcome.says_lost = metrics["counts"].contains("steps_with_tracking_lost");
  EXPECT_EQ(outcome.says_lost, !metrics["tracking_lost"].empty());
  if (outcome.says_lost) outcome.lost_after = metrics["tracking_lost"][0]["after_s"];
  return outcome;
}

}  // namespace lamina
