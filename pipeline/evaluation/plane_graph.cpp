// Reader and writer of .planegraph files.
#include <lamina/pipeline/evaluation/plane_graph.hpp>

#include <charconv>
#include <cstdio>
#include <fstream>
#include <iterator>

#include <lamina/models/error.hpp>

namespace lamina {
namespace {

constexpr int kMaxIndex = 100'000'000;

/// Words of one line, with the line's number for errors.
class Line {
 public:
  Line(const std::string& file, int number, std::string_view text)
      : file_(file), number_(number), rest_(text) {}

  std::string_view word() {
    const auto begin = rest_.find_first_not_of(" \t\r");
    if (begin == std::string_view::npos) return rest_ = {};
    rest_.remove_prefix(begin);
    const auto size = std::min(rest_.find_first_of(" \t\r"), rest_.size());
    const std::string_view found = rest_.substr(0, size);
    rest_.remove_prefix(size);
    return found;
  }
  double number(const char* expected) {
    const std::string_view text = word();
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) {
      fail(text, expected);
    }
    return value;
  }
  int index(const char* expected) {
    const std::string_view text = word();
    int value = -1;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || value < 0 ||
        value > kMaxIndex) {
      fail(text, expected);
    }
    return value;
  }
  SE3 pose() {
    Eigen::Vector4d q;
    for (int k = 0; k < 4; ++k) q(k) = number("a quaternion qx qy qz qw");
    Eigen::Vector3d t;
    for (int k = 0; k < 3; ++k) t(k) = number("a translation tx ty tz");
    if (std::abs(q.norm() - 1) > 1e-3) {
      fail("a quaternion of length " + std::to_string(q.norm()), "length 1");
    }
    return SE3(SO3(Eigen::Quaterniond(q(3), q(0), q(1), q(2))), t);
  }
  void end() {
    const std::string_view text = word();
    if (!text.empty()) fail(text, "the end of the line");
  }
  [[noreturn]] void fail(std::string_view found, const std::string& expected) const {
    const std::string text =
        found.empty() ? "the end of the line" : "'" + std::string(found.substr(0, 60)) + "'";
    throw input_error(file_, std::to_string(number_), text, expected);
  }

 private:
  const std::string& file_;
  int number_;
  std::string_view rest_;
};

void read_in_order(Line& line, const char* what, std::vector<SE3>& poses) {
  const int i = line.index("a pose index");
  if (i != static_cast<int>(poses.size())) {
    line.fail(std::to_string(i), std::string(what) + " " + std::to_string(poses.size()) +
                                     " (indices count up from 0)");
  }
  poses.push_back(line.pose());
}

void read_plane(Line& line, std::vector<Plane>& planes) {
  const int j = line.index("a plane index");
  if (j != static_cast<int>(planes.size())) {
    line.fail(std::to_string(j),
              "PLANE " + std::to_string(planes.size()) + " (indices count up from 0)");
  }
  Eigen::Vector3d n;
  for (int k = 0; k < 3; ++k) n(k) = line.number("a normal nx ny nz");
  const double d = line.number("a distance d");
  if (!(n.norm() > 0.5)) line.fail("a normal of length " + std::to_string(n.norm()), "length 1");
  planes.emplace_back(n, d);
}

PlaneGraph::Observation read_observation(Line& line) {
  PlaneGraph::Observation observation;
  observation.pose = line.index("a pose index");
  observation.plane = line.index("a plane index");
  Eigen::Matrix4d M;
  for (int r = 0; r < 4; ++r) {
    for (int c = r; c < 4; ++c) M(r, c) = M(c, r) = line.number("ten entries of the moments");
  }
  const auto count = static_cast<std::int64_t>(std::llround(std::clamp(M(3, 3), 0.0, 1e15)));
  const auto moments = Moments::from_homogeneous(M, count);
  if (!moments) line.fail("s33 = " + std::to_string(M(3, 3)), "a positive weight");
  observation.moments_body = *moments;
  return observation;
}

void read_record(Line& line, std::string_view key, PlaneGraph& problem) {
  if (key == "OBS") {
    problem.observations.push_back(read_observation(line));
    problem.plane_count = std::max(problem.plane_count, problem.observations.back().plane + 1);
  } else if (key == "INIT") {
    read_in_order(line, "INIT", problem.initial_map_body);
  } else if (key == "GT") {
    read_in_order(line, "GT", problem.truth_map_body);
  } else if (key == "ODO") {
    PlaneGraph::Odometry step;
    step.from = line.index("a pose index");
    step.to = line.index("a pose index");
    if (step.from == step.to) line.fail("ODO from a pose to itself", "two poses");
    step.T_from_to = line.pose();
    problem.odometry.push_back(step);
  } else if (key == "PLANE") {
    read_plane(line, problem.truth_planes);
  } else if (key == "SIG") {
    problem.sigma_translation = line.number("sigma_t");
    problem.sigma_rotation = line.number("sigma_r");
    problem.sigma_point = line.number("sigma_p");
    if (!(problem.sigma_translation > 0 && problem.sigma_rotation > 0 && problem.sigma_point > 0)) {
      line.fail("a sigma that is not positive", "sigma_t sigma_r sigma_p > 0");
    }
  } else {
    line.fail(key, "SIG, GT, INIT, PLANE, ODO or OBS");
  }
  line.end();
}

void check_references(const PlaneGraph& problem, const std::string& name) {
  const auto poses = static_cast<int>(problem.initial_map_body.size());
  if (poses == 0) throw input_error(name, "", "no INIT record", "at least one pose");
  const auto check = [&](int pose, const char* what) {
    if (pose < poses) return;
    throw input_error(name, "", std::string(what) + " of pose " + std::to_string(pose),
                      "an INIT record for it (there are " + std::to_string(poses) + ")");
  };
  for (const auto& step : problem.odometry) {
    check(step.from, "an ODO record");
    check(step.to, "an ODO record");
  }
  for (const auto& observation : problem.observations) check(observation.pose, "an OBS record");
  const std::size_t truth = problem.truth_map_body.size();
  if (truth != 0 && truth != problem.initial_map_body.size()) {
    throw input_error(name, "", std::to_string(truth) + " GT records",
                      "none or as many as INIT (" + std::to_string(poses) + ")");
  }
  // A graph of few observations cannot ask for memory of a hundred million planes.
  const auto limit = 1000 + 10 * static_cast<std::int64_t>(problem.observations.size());
  if (problem.plane_count > limit) {
    throw input_error(name, "", "plane index " + std::to_string(problem.plane_count - 1),
                      "indices that count up from 0");
  }
}

void print_pose(std::FILE* out, const SE3& T) {
  const auto& q = T.so3().quaternion();
  const auto& t = T.translation();
  std::fprintf(out, " %.12g %.12g %.12g %.12g %.12g %.12g %.12g\n", q.x(), q.y(), q.z(), q.w(),
               t.x(), t.y(), t.z());
}

}  // namespace

PlaneGraph parse_plane_graph(std::string_view text, const std::string& name) {
  PlaneGraph problem;
  int number = 0;
  while (!text.empty()) {
    const auto size = std::min(text.find('\n'), text.size());
    Line line(name, ++number, text.substr(0, size));
    text.remove_prefix(std::min(size + 1, text.size()));
    const std::string_view key = line.word();
    if (!key.empty() && key.front() != '#') read_record(line, key, problem);
  }
  problem.plane_count =
      std::max(problem.plane_count, static_cast<int>(problem.truth_planes.size()));
  check_references(problem, name);
  return problem;
}

PlaneGraph read_plane_graph(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw input_error(file.string(), "", "no readable file", "a .planegraph file");
  std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  if (in.bad()) throw input_error(file.string(), "", "a read error", "a .planegraph file");
  return parse_plane_graph(text, file.string());
}

void write_plane_graph(const PlaneGraph& problem, const std::filesystem::path& file) {
  std::FILE* out = std::fopen(file.c_str(), "w");
  if (out == nullptr) throw input_error(file.string(), "", "no writable place", "a new file");
  std::fprintf(out, "SIG %.12g %.12g %.12g\n", problem.sigma_translation, problem.sigma_rotation,
               problem.sigma_point);
  const auto poses = [out](const char* key, const std::vector<SE3>& list) {
    for (std::size_t i = 0; i < list.size(); ++i) {
      std::fprintf(out, "%s %zu", key, i);
      print_pose(out, list[i]);
    }
  };
  poses("GT", problem.truth_map_body);
  poses("INIT", problem.initial_map_body);
  for (std::size_t j = 0; j < problem.truth_planes.size(); ++j) {
    const auto& n = problem.truth_planes[j].normal();
    std::fprintf(out, "PLANE %zu %.12g %.12g %.12g %.12g\n", j, n.x(), n.y(), n.z(),
                 problem.truth_planes[j].rho());
  }
  for (const auto& step : problem.odometry) {
    std::fprintf(out, "ODO %d %d", step.from, step.to);
    print_pose(out, step.T_from_to);
  }
  for (const auto& observation : problem.observations) {
    std::fprintf(out, "OBS %d %d", observation.pose, observation.plane);
    const Eigen::Matrix4d M = observation.moments_body.homogeneous();
    for (int r = 0; r < 4; ++r) {
      for (int c = r; c < 4; ++c) std::fprintf(out, " %.14g", M(r, c));
    }
    std::fprintf(out, "\n");
  }
  const bool failed = std::ferror(out) != 0;
  if (std::fclose(out) != 0 || failed) {
    throw input_error(file.string(), "", "a write error", "room on the disk");
  }
}

}  // namespace lamina
