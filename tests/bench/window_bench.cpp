// The sliding window: benchmark problem, a window of 20 keyframes and 60 planes, an hour of it.
//   window_bench [FILE.planegraph]
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <numeric>
#include <random>
#include <string>

#include <lamina/backend/mapper/surfel_estimator.hpp>
#include <lamina/models/error.hpp>
#include <lamina/pipeline/evaluation/window_plane_graph.hpp>

using namespace lamina;

namespace {

double percentile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1,
                         static_cast<std::size_t>(share * static_cast<double>(values.size())))];
}

double mean(const double* begin, std::size_t count) {
  return std::accumulate(begin, begin + count, 0.0) /
         static_cast<double>(std::max<std::size_t>(1, count));
}

// The shortest of several runs of each step: what others on the machine add is taken out.
std::vector<double> least(const std::vector<std::vector<double>>& runs) {
  std::vector<double> result = runs.front();
  for (const auto& run : runs) {
    for (std::size_t i = 0; i < result.size(); ++i) result[i] = std::min(result[i], run[i]);
  }
  return result;
}

void print_times(const char* name, const std::vector<double>& ms) {
  const std::size_t tenth = ms.size() / 10;
  std::printf("%-34s mean %.3f median %.3f p99 %.3f max %.3f ms, last tenth / second tenth %.2f\n",
              name, mean(ms.data(), ms.size()), percentile(ms, 0.5), percentile(ms, 0.99),
              percentile(ms, 1.0), mean(&ms[ms.size() - tenth], tenth) / mean(&ms[tenth], tenth));
}

void plane_graph(const char* file) {
  const PlaneGraph problem = read_plane_graph(file);
  std::vector<std::vector<double>> runs;
  WindowRun run;
  for (int k = 0; k < 3; ++k) {
    run = run_window_on_plane_graph(problem, WindowOptions());
    runs.push_back(run.step_ms);
  }
  double sum = 0;
  for (std::size_t i = 0; i < problem.truth_map_body.size(); ++i) {
    sum +=
        (run.T_map_body[i].translation() - problem.truth_map_body[i].translation()).squaredNorm();
  }
  print_times("plane graph, 20 keyframes", least(runs));
  std::printf("  ate %.4f m over %zu poses, %.2f steps a pose\n",
              std::sqrt(sum / static_cast<double>(problem.truth_map_body.size())),
              problem.truth_map_body.size(),
              run.iterations / static_cast<double>(problem.truth_map_body.size()));
}

// Of the processor: what others on the machine do does not show.
double cpu_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

template <class F>
double least_ms(int repetitions, F&& f) {
  double least = 1e9;
  for (int k = 0; k < repetitions; ++k) {
    const double start = cpu_ms();
    f();
    least = std::min(least, cpu_ms() - start);
  }
  return least;
}

// Covariances of a solved window, the least of some repetitions. Those of surfels, given the poses,
// come with their closed form in each step.
void print_covariance(const char* name, const SlidingWindow& window) {
  double own = 0, whole = 0;
  const double own_ms = least_ms(20, [&] {
    const WindowCovariances all = window.covariances();
    own = 0;
    for (const auto& C : all.poses) own += C.trace();
    for (const auto& C : all.planes) own += C.trace();
  });
  const double whole_ms = least_ms(20, [&] { whole = window.covariance().trace(); });
  std::printf(
      "covariances of a whole window, %-14s %zu poses, %zu planes: %.2f ms each by itself, %.2f ms "
      "with all cross terms (traces %.6g %.6g)\n",
      name, window.keyframe_count(), window.plane_count(), own_ms, whole_ms, own, whole);
}

// A robot in a hall of 60 planes, 15 of which each keyframe sees; 500 surfels solved at each.
std::vector<double> big_window(int keyframes, unsigned seed, int lag = 20,
                               bool with_covariance = false) {
  std::mt19937 rng(seed);
  std::normal_distribution<double> normal;
  std::vector<Plane> planes;
  for (int j = 0; j < 60; ++j) {
    const Eigen::Vector3d n(normal(rng), normal(rng), normal(rng));
    planes.emplace_back(n, -n.norm() * (3 + std::abs(normal(rng))));
  }
  Matrix6d S = Matrix6d::Zero();
  S.diagonal() << Eigen::Vector3d::Constant(100), Eigen::Vector3d::Constant(500);
  WindowOptions options;
  options.keyframes = lag;
  SlidingWindow window{options};
  SE3 truth, guess;
  std::vector<double> ms;
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  scatter.diagonal() << 60, 60, 0.1;
  const Plane floor;
  for (int i = 0; i < keyframes; ++i) {
    const KeyframeId id{static_cast<std::int64_t>(i)};
    Vector6d step, e;
    step << 0.02 * std::cos(0.1 * i), 0.02 * std::sin(0.1 * i), 0, 0, 0, 0.1;
    for (int k = 0; k < 6; ++k) e(k) = normal(rng) * (k < 3 ? 0.01 : 0.002);
    const SE3 moved = i == 0 ? SE3() : SE3::exp(step);
    truth = truth * moved;
    const SE3 odometry = i == 0 ? SE3() : moved * SE3::exp(e);
    std::vector<PlaneMomentsFactor> seen;
    for (int k = 0; k < 15; ++k) {
      const auto j = static_cast<std::size_t>((4 * i + k) % 60);
      const Plane body = truth.inverse() * planes[j];
      const Eigen::Vector3d n = body.normal();
      const Eigen::Vector3d middle =
          body.project(Eigen::Vector3d::Zero()) + 0.002 * normal(rng) * n;
      const Matrix32d B = body.tangent_basis();
      const double w = 4e6;
      seen.push_back({id, PlaneId(std::int64_t(j)),
                      Moments(w, middle, B * (0.2 * w) * B.transpose(), 400), ExtrinsicsId::kNone,
                      1.0});
    }
    const double begin = cpu_ms();
    guess = i == 0 ? SE3() : window.pose(KeyframeId(i - 1)) * odometry;
    window.add_keyframe(id, {}, guess);
    if (i == 0) window.add(PriorFactor{id, guess, Matrix6d::Identity() * 1e4});
    if (i > 0) window.add(OdometryFactor{KeyframeId(i - 1), id, odometry, S});
    for (const auto& s : seen) {
      const Plane& plane = planes[static_cast<std::size_t>(s.plane)];
      if (!window.contains(s.plane)) {
        const Eigen::Vector3d anchor = plane.project(Eigen::Vector3d::Zero());
        window.add_plane(s.plane, plane.about(anchor), anchor);
      }
      window.add(s);
    }
    window.solve();
    window.marginalize();
    double height = 0;
    for (int k = 0; k < 500; ++k) {
      const Eigen::Vector2d c(0.1 * k, 0);
      const auto cell =
          solve_surfel(Moments(1e6, {0.1 * k, 0, 0.001}, scatter * 1e3, 60), c, &floor, {});
      height += cell ? cell->height : 0;
    }
    if (height < 0) std::puts("");  // keeps the loop
    ms.push_back(cpu_ms() - begin);
  }
  if (with_covariance) {
    window.solve();
    print_covariance("the large one", window);
  }
  return ms;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    if (argc > 1) plane_graph(argv[1]);
    for (const int lag : {10, 20, 40}) {
      std::vector<std::vector<double>> runs;
      for (int k = 0; k < 3; ++k) runs.push_back(big_window(300, 1, lag, lag == 20 && k == 0));
      auto ms = least(runs);
      ms.erase(ms.begin(), ms.begin() + 2 * lag);  // until it is full
      print_times((std::to_string(lag) + " keyframes, 60 planes, 500 surfels").c_str(), ms);
    }
    // An hour at a keyframe a second, once.
    auto hour = big_window(3600, 2);
    hour.erase(hour.begin(), hour.begin() + 40);
    print_times("20 keyframes, ..., an hour", hour);
  } catch (const Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
  return 0;
}
