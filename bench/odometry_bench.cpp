// Accuracy and speed of scan odometry, loop closing and depth odometry on recordings.
//   odometry_bench scans FILE.log [TRUTH.txt] [PICTURE.png]
#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include <lamina/frontend/odometry/scan_odometry.hpp>
#include <lamina/models/trajectory.hpp>

using namespace lamina;

namespace {

struct Item {
  LaserScan scan;
  SE3 T_odom_body;
};

double seconds_now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::vector<Item> read_log(const char* file) {
  std::ifstream in(file);
  std::vector<Item> items;
  Trajectory odometry;
  std::vector<LaserScan> scans;
  for (std::string line; std::getline(in, line);) {
    std::istringstream s(line);
    std::string kind;
    s >> kind;
    if (kind == "ODOM") {
      double x, y, th, tv, rv, a, t;
      s >> x >> y >> th >> tv >> rv >> a >> t;
      odometry.add(Timestamp::from_seconds(t), SE3::planar(x, y, th));
    } else if (kind == "FLASER") {
      LaserScan scan;
      int n;
      s >> n;
      scan.ranges.resize(static_cast<std::size_t>(n));
      for (float& r : scan.ranges) s >> r;
      scan.angle_min = -M_PI / 2;
      scan.angle_increment = M_PI / (n % 2 ? n - 1 : n);
      scan.range_max = 50;
      double skip, t;
      for (int i = 0; i < 6; ++i) s >> skip;
      s >> t;
      scan.stamp = Timestamp::from_seconds(t);
      scans.push_back(scan);
    } else if (kind == "ROBOTLASER1") {
      LaserScan scan;
      double type, fov, accuracy, remission, skip;
      int n, m;
      s >> type >> scan.angle_min >> fov >> scan.angle_increment >> scan.range_max >> accuracy >>
          remission >> n;
      scan.ranges.resize(static_cast<std::size_t>(n));
      for (float& r : scan.ranges) s >> r;
      s >> m;
      for (int i = 0; i < m; ++i) s >> skip;
      double lx, ly, lt, x, y, th, t;
      s >> lx >> ly >> lt >> x >> y >> th;
      for (int i = 0; i < 5; ++i) s >> skip;
      s >> t;
      scan.lidar.T_body_lidar = SE3::planar(x, y, th).inverse() * SE3::planar(lx, ly, lt);
      scan.stamp = Timestamp::from_seconds(t);
      scans.push_back(scan);
    }
  }
  for (const LaserScan& scan : scans) {
    if (const auto T = odometry.at(scan.stamp)) items.push_back({scan, *T});
  }
  return items;
}

Matrix6d wheel_covariance(const SE3& T) {
  const double d = T.translation().norm(), a = T.so3().log().norm();
  const double st = 0.02 * std::sqrt(d) + 0.001;
  const double sr = 0.02 * std::sqrt(d) + 0.05 * std::sqrt(a) + 0.0005;
  Vector6d v;
  v << st * st, st * st, 1e-6, 1e-6, 1e-6, sr * sr;
  return v.asDiagonal();
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
  std::printf("%-28s ATE rmse %.3f m, max %.3f m over %zu poses\n", what,
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

int scans(int argc, char** argv) {
  const auto items = read_log(argv[2]);
  std::printf("%zu scans\n", items.size());
  Trajectory truth, wheels, odometry, no_wheels;
  if (argc > 3) truth = Trajectory::read_tum(std::filesystem::path(argv[3]));
  for (const bool use_wheels : {true, false}) {
    ScanOdometry matcher;
    SE3 T;
    int degenerate = 0, lost = 0, searched = 0;
    Trajectory& out = use_wheels ? odometry : no_wheels;
    const double start = seconds_now();
    double matched = 0, iterations = 0;
    for (std::size_t i = 0; i < items.size(); ++i) {
      std::optional<MotionGuess> guess;
      if (use_wheels && i > 0) {
        const SE3 d = items[i - 1].T_odom_body.inverse() * items[i].T_odom_body;
        guess = MotionGuess{d, wheel_covariance(d)};
      }
      const ScanMotion m = matcher.process(items[i].scan, guess);
      T = T * m.T_prev_curr_body;
      degenerate += m.status == ScanMotion::Status::kDegenerate;
      if (m.status == ScanMotion::Status::kPredicted) {
        ++lost;
        if (lost < 10)
          std::printf("lost at %zu matched %.2f unknown %d\n", i, m.matched, m.unknown_directions);
      }
      searched += m.searched;
      matched += m.matched;
      iterations += m.iterations;
      out.add(items[i].scan.stamp, T);
      if (use_wheels) wheels.add(items[i].scan.stamp, items[i].T_odom_body);
    }
    const double n = static_cast<double>(items.size());
    std::printf(
        "%s: %.2f s, %.3f ms a scan; degenerate %d lost %d searched %d matched %.3f iterations "
        "%.1f\n",
        use_wheels ? "with wheels" : "scans alone", seconds_now() - start,
        1e3 * (seconds_now() - start) / n, degenerate, lost, searched, matched / n, iterations / n);
  }
  print_ate("wheels", wheels, truth);
  print_ate("scan odometry, wheels", odometry, truth);
  print_ate("scan odometry, no wheels", no_wheels, truth);
  if (argc > 4) draw(argv[4], items, odometry, 0.05);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 2 && std::strcmp(argv[1], "scans") == 0) return scans(argc, argv);
  std::printf("usage: odometry_bench scans FILE.log [TRUTH.txt] [PICTURE.png]\n");
  return 2;
}
