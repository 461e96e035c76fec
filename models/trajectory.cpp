// Interpolation, TUM reading and writing.
#include <lamina/models/trajectory.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <istream>
#include <ostream>
#include <string_view>

#include <lamina/models/error.hpp>

namespace lamina {
namespace {

// Splits at blanks and tabs; a trailing carriage return is dropped.
std::vector<std::string_view> fields_of(std::string_view line) {
  std::vector<std::string_view> fields;
  std::size_t i = 0;
  while (i < line.size()) {
    const std::size_t begin = line.find_first_not_of(" \t\r", i);
    if (begin == std::string_view::npos) break;
    const std::size_t end = std::min(line.find_first_of(" \t\r", begin), line.size());
    fields.push_back(line.substr(begin, end - begin));
    i = end;
  }
  return fields;
}

std::optional<double> number_of(std::string_view text) {
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) {
    return std::nullopt;
  }
  return value;
}

}  // namespace

bool Trajectory::add(Timestamp stamp, const SE3& pose) {
  if (!poses_.empty() && stamp <= poses_.back().stamp) return false;
  poses_.push_back({stamp, pose});
  return true;
}

std::optional<SE3> Trajectory::at(Timestamp stamp, double max_gap) const {
  const auto after =
      std::lower_bound(poses_.begin(), poses_.end(), stamp,
                       [](const StampedPose& pose, Timestamp time) { return pose.stamp < time; });
  if (after == poses_.end()) return std::nullopt;
  if (after->stamp == stamp) return after->pose;
  if (after == poses_.begin()) return std::nullopt;
  const auto before = after - 1;
  const double span = after->stamp - before->stamp;
  if (span > max_gap) return std::nullopt;
  return SE3::interpolate(before->pose, after->pose, (stamp - before->stamp) / span);
}

double Trajectory::length() const {
  double sum = 0;
  for (std::size_t i = 1; i < poses_.size(); ++i) {
    sum += (poses_[i].pose.translation() - poses_[i - 1].pose.translation()).norm();
  }
  return sum;
}

Trajectory Trajectory::read_tum(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) throw Error(file.string() + ": cannot be opened, expected a TUM trajectory");
  return read_tum(in, file.string());
}

Trajectory Trajectory::read_tum(std::istream& in, const std::string& name) {
  Trajectory trajectory;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    const auto fields = fields_of(line);
    if (fields.empty() || fields[0].front() == '#') continue;
    const auto fail = [&](const std::string& found, const std::string& expected) {
      return input_error(name, std::to_string(number), found, expected);
    };
    if (fields.size() != 8) {
      throw fail(std::to_string(fields.size()) + " columns", "8: timestamp tx ty tz qx qy qz qw");
    }
    const auto stamp = Timestamp::parse(fields[0]);
    if (!stamp) throw fail("'" + std::string(fields[0]) + "'", "a time in seconds");
    std::array<double, 7> v{};
    for (std::size_t i = 0; i < 7; ++i) {
      const auto value = number_of(fields[i + 1]);
      if (!value) throw fail("'" + std::string(fields[i + 1]) + "'", "a finite number");
      v[i] = *value;
    }
    const Eigen::Quaterniond q(v[6], v[3], v[4], v[5]);
    if (std::abs(q.norm() - 1.0) > 1e-2)
      throw fail("a quaternion of length " + std::to_string(q.norm()), "length 1");
    if (!trajectory.add(*stamp, SE3(SO3(q), {v[0], v[1], v[2]}))) {
      throw fail("time " + std::string(fields[0]) + " not after the line before",
                 "increasing times");
    }
  }
  return trajectory;
}

void Trajectory::write_tum(std::ostream& out) const {
  char line[256];
  for (const auto& [stamp, pose] : poses_) {
    const auto& t = pose.translation();
    const auto& q = pose.so3().quaternion();
    std::snprintf(line, sizeof line, "%s %.9f %.9f %.9f %.9f %.9f %.9f %.9f\n",
                  stamp.to_string().c_str(), t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
    out << line;
  }
}

}  // namespace lamina
