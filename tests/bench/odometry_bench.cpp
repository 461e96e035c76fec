// Accuracy and speed of scan odometry, loop closing and depth odometry on recordings.
//   odometry_bench depth RECORDING [TRUTH.txt|-] [frames]
//   odometry_bench scans RECORDING [TRUTH.txt|-] [PICTURE]
#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include <lamina/frontend/loops/loop_closer.hpp>
#include <lamina/frontend/motion/depth_odometry.hpp>
#include <lamina/frontend/motion/scan_odometry.hpp>
#include <lamina/models/trajectory.hpp>
#include <lamina/sensors/odometry_track.hpp>
#include <lamina/sensors/recording.hpp>

using namespace lamina;

namespace {

struct Item {
  LaserScan scan;
  SE3 T_odom_body;
  OdometryModel odometry;
};

/// CPU time of this thread: others may be using the machine.
double seconds_now() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

std::vector<Item> read_scans(const std::string& input) {
  const auto recording = open_recording(input);
  std::vector<LaserScan> scans;
  std::vector<Odometry> odometry;
  while (const auto m = recording->next()) {
    if (const auto* scan = std::get_if<LaserScan>(&*m)) scans.push_back(*scan);
    if (const auto* o = std::get_if<Odometry>(&*m)) odometry.push_back(*o);
  }
  const OdometryTrack track(odometry);
  std::vector<Item> items;
  for (const LaserScan& scan : scans) {
    if (const auto o = track.at(scan.stamp)) {
      items.push_back({scan, o->T_odom_body, recording->calibration().odometry});
    }
  }
  return items;
}

void print_ate(const char* what, const Trajectory& estimate, const Trajectory& truth) {
  std::vector<Eigen::Vector3d> a, b;
  for (const StampedPose& p : estimate) {
    if (const auto T = truth.at(p.stamp, 0.5)) {
      a.push_back(p.pose.translation());
      b.push_back(T->translation());
    }
  }
  if (a.size() < 3) return;
  Eigen::Matrix3Xd A(3, a.size()), B(3, a.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    A.col(static_cast<Eigen::Index>(i)) = a[i];
    B.col(static_cast<Eigen::Index>(i)) = b[i];
  }
  const Eigen::Matrix4d T = Eigen::umeyama(A, B, false);
  double sum = 0, worst = 0;
  for (Eigen::Index i = 0; i < A.cols(); ++i) {
    const double e =
        (T.topLeftCorner<3, 3>() * A.col(i) + T.topRightCorner<3, 1>() - B.col(i)).norm();
    sum += e * e;
    worst = std::max(worst, e);
  }
  std::printf("%-28s ATE rmse %.4f m, max %.4f m over %zu poses\n", what,
              std::sqrt(sum / static_cast<double>(a.size())), worst, a.size());
}

void draw(const char* file, const std::vector<Item>& items, const Trajectory& poses, double cell) {
  std::vector<Eigen::Vector2d> points;
  Eigen::Vector2d low(1e9, 1e9), high(-1e9, -1e9);
  std::vector<std::pair<Eigen::Vector2d, bool>> marks;
  for (std::size_t i = 0; i < items.size() && i < poses.size(); ++i) {
    const LaserScan& s = items[i].scan;
    for (std::size_t k = 0; k < s.size(); ++k) {
      if (!s.valid(k) || s.ranges[k] > 15) continue;
      const Eigen::Vector2d q = s.point(k);
      const Eigen::Vector3d p =
          poses[i].pose * (s.lidar.T_body_lidar * Eigen::Vector3d(q.x(), q.y(), 0));
      marks.push_back({p.head<2>(), false});
    }
    marks.push_back({poses[i].pose.translation().head<2>(), true});
    low = low.cwiseMin(marks.back().first - Eigen::Vector2d(8, 8));
    high = high.cwiseMax(marks.back().first + Eigen::Vector2d(8, 8));
  }
  const int w = static_cast<int>((high.x() - low.x()) / cell),
            h = static_cast<int>((high.y() - low.y()) / cell);
  cv::Mat image(h, w, CV_8UC3, cv::Scalar(255, 255, 255));
  for (const auto& [p, path] : marks) {
    const int u = static_cast<int>((p.x() - low.x()) / cell),
              v = h - 1 - static_cast<int>((p.y() - low.y()) / cell);
    if (u < 0 || v < 0 || u >= w || v >= h) continue;
    cv::Vec3b& c = image.at<cv::Vec3b>(v, u);
    if (path)
      c = {0, 0, 255};
    else
      for (int k = 0; k < 3; ++k) c[k] = static_cast<uchar>(c[k] > 40 ? c[k] - 40 : 0);
  }
  cv::imwrite(file, image);
}

struct Run {
  Trajectory odometry, corrected;
};

Run run_scans(const std::vector<Item>& items, bool use_wheels, const Trajectory& truth) {
  Run run;
  ScanOdometry matcher;
  LoopCloser closer;
  SE3 T;
  int degenerate = 0, lost = 0, searched = 0;
  double odometry_s = 0, loop_s = 0, matched = 0;
  std::vector<LoopClosure> loops;
  const auto keep = [&](std::vector<LoopClosure> more) {
    loops.insert(loops.end(), more.begin(), more.end());
  };
  for (std::size_t i = 0; i < items.size(); ++i) {
    std::optional<MotionGuess> guess;
    if (use_wheels && i > 0) {
      const SE3 d = items[i - 1].T_odom_body.inverse() * items[i].T_odom_body;
      guess = MotionGuess{d, increment_covariance(items[i].odometry, d)};
    }
    const double t0 = seconds_now();
    const ScanMotion m = matcher.process(items[i].scan, guess);
    const double t1 = seconds_now();
    keep(closer.add(items[i].scan, m));
    odometry_s += t1 - t0;
    loop_s += seconds_now() - t1;
    T = T * m.T_prev_curr_body;
    degenerate += m.status == ScanMotion::Status::kDegenerate;
    lost += m.status == ScanMotion::Status::kPredicted;
    searched += m.searched;
    matched += m.matched;
    run.odometry.add(items[i].scan.stamp, T);
  }
  const double t0 = seconds_now();
  keep(closer.finish());
  loop_s += seconds_now() - t0;
  run.corrected = closer.corrected();
  const LoopCloser::Counts& c = closer.counts();
  std::printf("%s: odometry %.2f s (%.3f ms a scan), loops %.2f s\n",
              use_wheels ? "with wheels" : "scans alone", odometry_s,
              1e3 * odometry_s / static_cast<double>(items.size()), loop_s);
  std::printf("  degenerate %d, predicted %d, searched %d, matched %.3f\n", degenerate, lost,
              searched, matched / static_cast<double>(items.size()));
  std::printf(
      "  submaps %d, tried %d, found %d, ambiguous %d, unmatched %d, open %d, "
      "contradicted %d, inconsistent %d, accepted %d\n",
      c.submaps, c.tried, c.found, c.ambiguous, c.unmatched, c.open_direction, c.contradicted,
      c.inconsistent, c.accepted);
  // Loops against the reference: how far off, and how far off in their own sigmas.
  double sum_t = 0, max_t = 0, sum_chi = 0;
  int n = 0;
  for (const LoopClosure& l : loops) {
    const auto a = truth.at(l.from, 0.5), b = truth.at(l.to, 0.5);
    if (!a || !b) continue;
    const SE3 e = (a->inverse() * *b).inverse() * l.T_from_to;
    const double t = e.translation().norm();
    const Vector6d d = e.log();
    sum_t += t * t;
    max_t = std::max(max_t, t);
    sum_chi += d.dot(l.covariance.ldlt().solve(d));
    ++n;
  }
  if (n > 0) {
    std::printf("  loops against the reference: rms %.3f m, max %.3f m, chi2/3 %.2f over %d\n",
                std::sqrt(sum_t / n), max_t, sum_chi / n / 3, n);
  }
  print_ate("  odometry", run.odometry, truth);
  print_ate("  with loops", run.corrected, truth);
  return run;
}

int scans(int argc, char** argv) {
  const auto items = read_scans(argv[2]);
  std::printf("%zu scans\n", items.size());
  Trajectory truth, wheels;
  if (argc > 3 && std::strcmp(argv[3], "-") != 0)
    truth = Trajectory::read_tum(std::filesystem::path(argv[3]));
  for (const Item& item : items) wheels.add(item.scan.stamp, item.T_odom_body);
  print_ate("wheels", wheels, truth);
  const Run run = run_scans(items, true, truth);
  run_scans(items, false, truth);
  if (argc > 4) {
    const std::string picture = argv[4];
    draw((picture + "_odometry.png").c_str(), items, run.odometry, 0.05);
    draw((picture + "_loops.png").c_str(), items, run.corrected, 0.05);
  }
  return 0;
}

int depth(int argc, char** argv) {
  const auto recording = open_recording(argv[2]);
  Trajectory truth, poses;
  if (argc > 3 && std::strcmp(argv[3], "-") != 0) {
    truth = Trajectory::read_tum(std::filesystem::path(argv[3]));
  }
  DepthOdometry odometry;
  SE3 T;
  int frames = 0, keys = 0, degenerate = 0, predicted = 0;
  double spent = 0, matched = 0, slowest = 0;
  std::optional<SE3> last_true;
  while (const auto m = recording->next()) {
    const auto* frame = std::get_if<DepthFrame>(&*m);
    if (!frame) continue;
    const double t0 = seconds_now();
    const DepthMotion motion = odometry.process(*frame);
    const double t = seconds_now() - t0;
    spent += t;
    slowest = std::max(slowest, t);
    T = T * motion.T_prev_curr_body;
    poses.add(frame->stamp, T);
    if (argc > 4) {
      const Eigen::Vector3d x = T.translation(), up = T.so3() * Eigen::Vector3d::UnitZ();
      std::printf(
          "%4d %d open %d moving %.3f matched %.2f rms %.4f at %.3f %.3f %.3f yaw %.1f tilt %.1f\n",
          frames, static_cast<int>(motion.status), motion.unknown_directions, motion.moving,
          motion.matched, motion.rms, x.x(), x.y(), x.z(), T.so3().yaw() * 180 / M_PI,
          std::acos(up.z()) * 180 / M_PI);
      const auto now_true = truth.at(frame->stamp);
      if (now_true && last_true) {
        const Vector6d e =
            ((last_true->inverse() * *now_true).inverse() * motion.T_prev_curr_body).log();
        std::printf("       off %.3f m, %.2f deg; chi2 %.1f; 1-sigma %.3f m\n", e.head<3>().norm(),
                    e.tail<3>().norm() * 180 / M_PI, e.dot(motion.covariance.ldlt().solve(e)),
                    std::sqrt(motion.covariance.topLeftCorner<3, 3>().trace()));
      }
      last_true = now_true;
    }
    ++frames;
    keys += motion.key_frame;
    matched += motion.matched;
    degenerate += motion.status == ScanMotion::Status::kDegenerate;
    predicted += motion.status == ScanMotion::Status::kPredicted;
  }
  std::printf(
      "%d frames, %.2f ms a frame (most %.2f), %d key frames, degenerate %d, predicted %d, "
      "matched %.3f\n",
      frames, 1e3 * spent / frames, 1e3 * slowest, keys, degenerate, predicted, matched / frames);
  const SE3 end = poses.back().pose;
  std::printf("end at %.3f %.3f %.3f m, turned %.2f deg, length %.2f m\n", end.translation().x(),
              end.translation().y(), end.translation().z(), end.so3().log().norm() * 180 / M_PI,
              poses.length());
  print_ate("depth odometry", poses, truth);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 2 && std::strcmp(argv[1], "scans") == 0) return scans(argc, argv);
  if (argc > 2 && std::strcmp(argv[1], "depth") == 0) return depth(argc, argv);
  std::printf("usage: odometry_bench depth RECORDING [TRUTH.txt|-] [frames]\n");
  std::printf("usage: odometry_bench scans RECORDING [TRUTH.txt|-] [PICTURE]\n");
  return 2;
}
