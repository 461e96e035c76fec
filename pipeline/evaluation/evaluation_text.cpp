// The table and the JSON of an evaluation, and its limits.
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include <lamina/io/atomic_file.hpp>
#include <lamina/models/median.hpp>
#include <lamina/pipeline/evaluation/evaluation.hpp>

namespace lamina {
namespace {

using Json = nlohmann::ordered_json;

std::string row(const std::string& name, const ErrorStatistics& s, const char* unit) {
  return fmt::format("{:<26} rmse {:9.4f}  mean {:9.4f}  median {:9.4f}  max {:9.4f} {}\n", name,
                     s.rmse, s.mean, s.median, s.max, unit);
}

Json to_json(const ErrorStatistics& s) {
  return {
      {"count", s.count}, {"rmse", s.rmse}, {"mean", s.mean}, {"median", s.median}, {"max", s.max}};
}

Json to_json(const TrajectoryError& t) {
  return {{"matched", t.matched},
          {"estimated", t.estimated},
          {"length_m", t.length_m},
          {"ate_m", to_json(t.ate_m)},
          {"ate_deg", to_json(t.ate_deg)},
          {"ate_height_m", to_json(t.ate_height_m)},
          {"ate_first_aligned_m", to_json(t.ate_first_m)},
          {"ate_unaligned_m", to_json(t.ate_unaligned_m)},
          {"rpe_interval_s", t.rpe_interval_s},
          {"rpe_m", to_json(t.rpe_m)},
          {"rpe_deg", to_json(t.rpe_deg)}};
}

Json to_json(const PlaneErrors& p) {
  Json json{{"matched", p.matches.size()},
            {"missed", p.missed},
            {"split", p.split},
            {"merged", p.merged},
            {"spurious", p.spurious},
            {"rho_mean_m", p.rho_mean_m},
            {"rho_max_m", p.rho_max_m},
            {"angle_mean_deg", p.angle_mean_deg},
            {"angle_max_deg", p.angle_max_deg}};
  json["matches"] = Json::array();
  for (const PlaneMatch& m : p.matches) {
    json["matches"].push_back({{"truth", m.reference_id},
                               {"map", m.map_id},
                               {"rho_error_m", m.rho_error_m},
                               {"angle_error_deg", m.angle_error_deg},
                               {"normalized_squared", m.normalized_squared}});
  }
  return json;
}

Json to_json(const GridErrors& g) {
  return {{"compared", g.compared},
          {"true_free", g.true_free},
          {"true_blocked", g.true_blocked},
          {"called_free", g.called_free},
          {"false_free", g.false_free},
          {"false_free_pits", g.false_free_pits},
          {"false_free_deep", g.false_free_deep},
          {"false_free_share", g.false_free_share},
          {"flat_floor", g.flat_floor},
          {"false_blocked", g.false_blocked},
          {"false_blocked_share", g.false_blocked_share},
          {"blocked_edges", g.blocked_edges},
          {"unknown_flat", g.unknown_flat},
          {"unknown_share", g.unknown_share},
          {"height_rms_m", g.height_rms_m},
          {"height_bias_m", g.height_bias_m},
          {"height_max_m", g.height_max_m},
          {"unknown_ends", g.unknown_ends},
          {"near_height_rms_m", g.near_height_rms_m},
          {"near_heights", g.near_heights}};
}

std::string name_of(Alignment alignment) {
  if (alignment == Alignment::kNone) return "none";
  return alignment == Alignment::kYaw ? "yaw" : "se3";
}

Json with_deviation(const ErrorStatistics& s) {
  Json json = to_json(s);
  json["std"] = s.deviation();
  return json;
}

Json to_json(const RelationErrors& r) {
  return {{"count", r.translation_m.count},
          {"without_pose", r.without_pose},
          {"translation_m", with_deviation(r.translation_m)},
          {"rotation_deg", with_deviation(r.rotation_deg)},
          {"worst", {r.worst.from.seconds(), r.worst.to.seconds()}}};
}

std::string relations_text(const RelationErrors& r) {
  const auto line = [](const char* name, const ErrorStatistics& s, const char* unit) {
    return fmt::format("{:<26} mean {:9.4f}  std {:10.4f}  median {:9.4f}  max {:9.4f} {}\n", name,
                       s.mean, s.deviation(), s.median, s.max, unit);
  };
  std::string text = fmt::format("relations                  {} compared", r.translation_m.count);
  if (r.without_pose > 0) text += fmt::format(", {} without a pose at their times", r.without_pose);
  return text +
         fmt::format(", largest error from {} to {}\n", r.worst.from.to_string(),
                     r.worst.to.to_string()) +
         line("relations, translation", r.translation_m, "m") +
         line("relations, rotation", r.rotation_deg, "degrees");
}

// How honest the planes' sigmas are: squared errors over their covariance, 3 degrees of freedom.
std::string sigmas_text(const PlaneErrors& p) {
  constexpr double kOneInAThousand = 16.27;
  if (p.matches.empty()) return "";
  std::vector<double> squared;
  for (const PlaneMatch& m : p.matches) squared.push_back(m.normalized_squared);
  const auto beyond = std::count_if(squared.begin(), squared.end(),
                                    [](double value) { return value > kOneInAThousand; });
  return fmt::format(
      "plane sigmas               squared error over covariance median {:.2f} (2.37 due), above "
      "{} (0.1 % due) {} of {}\n",
      median(squared), kOneInAThousand, beyond, squared.size());
}

std::string planes_text(const PlaneErrors& p) {
  return fmt::format(
             "planes                     matched {}, missed {}, split {}, merged {}, spurious {}\n"
             "plane distance             mean {:.4f}  max {:.4f} m\n"
             "plane angle                mean {:.3f}  max {:.3f} degrees\n",
             p.matches.size(), p.missed.size(), p.split.size(), p.merged.size(), p.spurious.size(),
             p.rho_mean_m, p.rho_max_m, p.angle_mean_deg, p.angle_max_deg) +
         sigmas_text(p);
}

std::string grid_text(const GridErrors& g) {
  return fmt::format(
      "grid free                  {} cells; falsely free {} ({:.3f} %), of these in holes and over "
      "ledges {}, further than a cell from free ground {}\n"
      "grid flat floor            {} cells seen; falsely blocked {} ({:.3f} %), unknown {} ({:.3f} "
      "%), of these beside what nobody saw {}\n"
      "grid edges                 {} free cells within {:.2f} m of an edge called blocked\n"
      "grid height                rms {:.4f}  bias {:.4f}  max {:.4f} m; within {:.0f} m of the "
      "path rms {:.4f} m ({} cells)\n",
      g.called_free, g.false_free, 100 * g.false_free_share, g.false_free_pits, g.false_free_deep,
      g.flat_floor, g.false_blocked, 100 * g.false_blocked_share, g.unknown_flat,
      100 * g.unknown_share, g.unknown_ends, g.blocked_edges, GridErrors::kTolerance,
      g.height_rms_m, g.height_bias_m, g.height_max_m, GridErrors::kNearPath, g.near_height_rms_m,
      g.near_heights);
}

}  // namespace

std::string to_text(const Evaluation& evaluation) {
  std::string text;
  if (evaluation.trajectory) {
    const TrajectoryError& t = *evaluation.trajectory;
    text += fmt::format("poses                      {} of {} matched over {:.1f} m\n", t.matched,
                        t.estimated, t.length_m);
    if (evaluation.marker) {
      const Eigen::Vector3d& lever = evaluation.marker->lever_body;
      text += fmt::format(
          "marker of the reference    at {:.3f} {:.3f} {:.3f} m of the body, its clock {:+.4f} s\n",
          lever.x(), lever.y(), lever.z(), evaluation.marker->clock_s);
    }
    const std::string how = evaluation.alignment == Alignment::kNone  ? ", not moved"
                            : evaluation.alignment == Alignment::kYaw ? " by yaw"
                                                                      : "";
    text += row("ATE aligned" + how, t.ate_m, "m");
    text += row("ATE aligned" + how + ", angle", t.ate_deg, "degrees");
    text += row("ATE aligned" + how + ", height", t.ate_height_m, "m");
    text += row("ATE from the first pose", t.ate_first_m, "m");
    text += row("ATE as it stands", t.ate_unaligned_m, "m");
    text += row(fmt::format("RPE over {:g} s", t.rpe_interval_s), t.rpe_m, "m");
    text += row(fmt::format("RPE over {:g} s, angle", t.rpe_interval_s), t.rpe_deg, "degrees");
  }
  if (evaluation.relations) text += relations_text(*evaluation.relations);
  if (evaluation.planes) text += planes_text(*evaluation.planes);
  if (evaluation.map_planes > 0) {
    text += fmt::format(
        "planes near each other     {} pairs among {}: parallel within 2 degrees, within 0.3 m, "
        "one before the other\n",
        evaluation.near_pairs.size(), evaluation.map_planes);
  }
  if (evaluation.grid) text += grid_text(*evaluation.grid);
  if (evaluation.path) {
    text +=
        fmt::format("path                       {} places, {} of them not on truly free ground\n",
                    evaluation.path->places, evaluation.path->not_free);
  }
  for (const auto& remark : evaluation.remarks) text += "note: " + remark + "\n";
  return text;
}

void write_evaluation(const std::filesystem::path& file, const Evaluation& evaluation) {
  Json json = Json::object();
  if (evaluation.trajectory) {
    json["trajectory"] = to_json(*evaluation.trajectory);
    json["trajectory"]["alignment"] = name_of(evaluation.alignment);
    json["trajectory"]["by_index"] = evaluation.by_index;
    json["trajectory"]["times"] = evaluation.trajectory->times;
    json["trajectory"]["errors_m"] = evaluation.trajectory->errors_m;
  }
  if (evaluation.relations) json["relations"] = to_json(*evaluation.relations);
  if (evaluation.planes) json["planes"] = to_json(*evaluation.planes);
  if (evaluation.map_planes > 0) json["near_pairs"] = evaluation.near_pairs;
  if (evaluation.grid) json["grid"] = to_json(*evaluation.grid);
  if (evaluation.path) {
    json["path"] = {{"places", evaluation.path->places}, {"not_free", evaluation.path->not_free}};
  }
  json["remarks"] = evaluation.remarks;
  io::write_atomically(file, json.dump(1) + "\n");
}

std::vector<std::string> exceeded(const Evaluation& e, const EvaluationLimits& limits) {
  std::vector<std::string> lines;
  const auto check = [&lines](const std::string& name, const std::optional<double>& limit,
                              const std::optional<double>& reached) {
    if (!limit) return;
    if (!reached) {
      lines.push_back(name + ": nothing to compare with, the limit cannot be checked");
    } else if (!(*reached <= *limit)) {
      lines.push_back(
          fmt::format("{}: found {:.5g}, expected at most {:g}", name, *reached, *limit));
    }
  };
  const auto of = [](const auto& part, auto value) -> std::optional<double> {
    if (!part) return std::nullopt;
    return static_cast<double>(value(*part));
  };
  const auto ate = [](const TrajectoryError& t) { return t.ate_m.rmse; };
  const auto rpe = [](const TrajectoryError& t) { return t.rpe_m.rmse; };
  check("ATE (m)", limits.max_ate_m, of(e.trajectory, ate));
  check("RPE (m)", limits.max_rpe_m, of(e.trajectory, rpe));
  check("plane distance (m)", limits.max_plane_rho_m,
        of(e.planes, [](const PlaneErrors& p) { return p.rho_mean_m; }));
  check("plane angle (degrees)", limits.max_plane_angle_deg,
        of(e.planes, [](const PlaneErrors& p) { return p.angle_mean_deg; }));
  check("missed planes", limits.max_missed,
        of(e.planes, [](const PlaneErrors& p) { return p.missed.size(); }));
  check("false free share", limits.max_false_free,
        of(e.grid, [](const GridErrors& g) { return g.false_free_share; }));
  return lines;
}

}  // namespace lamina
