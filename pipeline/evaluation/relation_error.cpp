// Reads relations and compares a path with them.
#include <lamina/pipeline/evaluation/relation_error.hpp>

#include <array>
#include <cmath>

#include <lamina/models/error.hpp>
#include <lamina/sensors/text.hpp>

namespace lamina {
namespace {

constexpr double kRounded = 1e-3;  // s, a stamp of the path's end may be rounded in the file

std::optional<SE3> pose_at(const Trajectory& path, Timestamp stamp, double max_gap) {
  if (const auto pose = path.at(stamp, max_gap)) return pose;
  if (path.empty()) return std::nullopt;
  for (const StampedPose& end : {path.front(), path.back()}) {
    if (std::abs(end.stamp - stamp) <= kRounded) return end.pose;
  }
  return std::nullopt;
}

Relation read_relation(std::string_view line, const std::string& file, int number) {
  const auto fail = [&](std::string_view found, const char* expected) {
    return input_error(file, std::to_string(number), shown(found), expected);
  };
  Relation relation;
  for (Timestamp* stamp : {&relation.from, &relation.to}) {
    const std::string_view field = next_field(line);
    const auto value = Timestamp::parse(field);
    if (!value) throw fail(field, "a time in seconds (t1 t2 x y z roll pitch yaw)");
    *stamp = *value;
  }
  std::array<double, 6> v{};
  for (double& value : v) {
    const std::string_view field = next_field(line);
    const auto number_read = parse_number(field);
    if (!number_read) throw fail(field, "a number (t1 t2 x y z roll pitch yaw)");
    value = *number_read;
  }
  relation.T_from_to =
      SE3(SO3::rot_z(v[5]) * SO3::rot_y(v[4]) * SO3::rot_x(v[3]), {v[0], v[1], v[2]});
  return relation;
}

}  // namespace

std::vector<Relation> read_relations(const std::filesystem::path& file) {
  const std::string text = read_file_bytes(file);
  std::vector<Relation> relations;
  std::string_view line;
  for (LineReader lines(text); lines.next(line);) {
    if (!is_comment(line)) relations.push_back(read_relation(line, file.string(), lines.number()));
  }
  if (relations.empty()) {
    throw input_error(file.string(), "", "no relation", "lines t1 t2 x y z roll pitch yaw");
  }
  return relations;
}

RelationErrors relation_errors(const Trajectory& estimate, const std::vector<Relation>& relations,
                               double max_gap) {
  RelationErrors errors;
  std::vector<double> metres, degrees;
  double largest = -1;
  for (const Relation& relation : relations) {
    const auto from = pose_at(estimate, relation.from, max_gap);
    const auto to = pose_at(estimate, relation.to, max_gap);
    if (!from || !to) {
      ++errors.without_pose;
      continue;
    }
    const SE3 error = relation.T_from_to.inverse() * from->inverse() * *to;
    metres.push_back(error.translation().norm());
    degrees.push_back(error.so3().log().norm() * 180 / M_PI);
    if (metres.back() > largest) errors.worst = relation;
    largest = std::max(largest, metres.back());
  }
  errors.translation_m = error_statistics(std::move(metres));
  errors.rotation_deg = error_statistics(std::move(degrees));
  return errors;
}

}  // namespace lamina
