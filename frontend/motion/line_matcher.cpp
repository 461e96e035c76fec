// Nearest oriented points on a grid of cells; Gauss-Newton on point-to-line distances.
#include <lamina/frontend/motion/line_matcher.hpp>

#include <Eigen/Cholesky>
#include <limits>

#include <lamina/models/linalg.hpp>

namespace lamina {

PointMap::PointMap(std::vector<OrientedPoint> points) {
  constexpr double kFarthest = 1e7;  // m: beyond is no place
  std::erase_if(points, [](const OrientedPoint& p) { return !(p.point.norm() < kFarthest); });
  if (points.empty()) return;
  Eigen::Vector2d low = points.front().point, high = low;
  for (const OrientedPoint& p : points) {
    low = low.cwiseMin(p.point);
    high = high.cwiseMax(p.point);
  }
  // Cells cost time and memory, too: few of them beside points, however far apart these are.
  constexpr double kCellsPerPoint = 8;
  const double most = kCellsPerPoint * static_cast<double>(points.size());
  while (((high - low) / cell_ + Eigen::Vector2d::Ones()).prod() > most) cell_ *= 1.5;
  origin_ = low;
  width_ = static_cast<int>((high.x() - low.x()) / cell_) + 1;
  height_ = static_cast<int>((high.y() - low.y()) / cell_) + 1;
  const auto cell_of = [&](const OrientedPoint& p) {
    const int ix = std::min(width_ - 1, static_cast<int>((p.point.x() - origin_.x()) / cell_));
    const int iy = std::min(height_ - 1, static_cast<int>((p.point.y() - origin_.y()) / cell_));
    return static_cast<std::size_t>(iy * width_ + ix);
  };
  first_.assign(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_) + 1, 0);
  for (const OrientedPoint& p : points) ++first_[cell_of(p) + 1];
  for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
  std::vector<int> next(first_.begin(), first_.end() - 1);
  points_.resize(points.size());
  for (const OrientedPoint& p : points) points_[static_cast<std::size_t>(next[cell_of(p)]++)] = p;
}

namespace {

// Of points whose normal agrees the nearest within a radius; of equally near ones the first.
struct NearestSearch {
  Eigen::Vector2d p, normal;
  bool any;
  double best_square;
  const OrientedPoint* best = nullptr;

  NearestSearch(const Eigen::Vector2d& to, const Eigen::Vector2d& like, double radius)
      : p(to), normal(like), any(like.x() == 0 && like.y() == 0), best_square(radius * radius) {}
  void offer(const OrientedPoint& q) {
    const double square = (q.point - p).squaredNorm();
    const bool nearer = square < best_square || (square == best_square && best && &q < best);
    if (!nearer || !(any || q.normal.dot(normal) > 0.7)) return;
    best_square = square;
    best = &q;
  }
};

}  // namespace

const OrientedPoint* PointMap::nearest(const Eigen::Vector2d& p, const Eigen::Vector2d& normal,
                                       double radius, const OrientedPoint* guess) const {
  if (points_.empty()) return nullptr;
  const double fx = (p.x() - origin_.x()) / cell_, fy = (p.y() - origin_.y()) / cell_;
  const double reach = radius / cell_;
  if (!(fx > -reach - 1 && fx < width_ + reach + 1 && fy > -reach - 1 && fy < height_ + reach + 1))
    return nullptr;
  NearestSearch search(p, normal, radius);
  if (guess) search.offer(*guess);
  // The cells of row y from x0 to x1.
  const auto look = [&](int y, int x0, int x1) {
    x0 = std::max(0, x0);
    x1 = std::min(width_ - 1, x1);
    if (x0 > x1) return;
    const std::size_t row = static_cast<std::size_t>(y * width_);
    const int begin = first_[row + static_cast<std::size_t>(x0)];
    const int end = first_[row + static_cast<std::size_t>(x1) + 1];
    for (int i = begin; i < end; ++i) search.offer(points_[static_cast<std::size_t>(i)]);
  };
  const int column = static_cast<int>(std::floor(fx)), own = static_cast<int>(std::floor(fy));
  if (!search.best && own >= 0 && own < height_) look(own, column, column);
  // Rows of cells outwards from the point's own, each no wider than what could still be nearer.
  const auto look_row = [&](int y) {
    constexpr double kSlack = 1e-9;  // cells squared: rounding must not hide a point
    const double off = std::max({0.0, y - fy, fy - (y + 1)});
    const double left = search.best_square / (cell_ * cell_) - off * off + kSlack;
    if (left < 0) return false;
    const double half = std::sqrt(left);
    look(y, static_cast<int>(std::floor(fx - half)), static_cast<int>(std::floor(fx + half)));
    return true;
  };
  const int middle = std::clamp(own, 0, height_ - 1);
  bool above = true, below = true;
  for (int k = 0; above || below; ++k) {
    below = below && middle - k >= 0 && look_row(middle - k);
    above = above && middle + k < height_ && (k == 0 || look_row(middle + k));
  }
  return search.best;
}

namespace {

struct System {
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double square_sum = 0;
  int inliers = 0, oriented = 0;
};

/// Sums over correspondences within `radius`; `scale` widens the robust kernel at first. `pairs`:
/// what each scan point met last (null: nothing), and meets now.
System linearise(const PointMap& map, const std::vector<OrientedPoint>& scan, std::size_t stride,
                 const PlanarPose& T, double radius, double scale, double inlier_sigmas,
                 std::vector<const OrientedPoint*>& pairs) {
  System s;
  const Eigen::Matrix2d R = T.rotation();
  const Eigen::Vector2d t = T.translation();
  const OrientedPoint* neighbour = nullptr;
  for (std::size_t i = 0; i < scan.size(); i += stride) {
    const OrientedPoint& p = scan[i];
    if (!p.oriented()) continue;
    ++s.oriented;
    const Eigen::Vector2d normal = R * p.normal;
    const OrientedPoint* guess = pairs[i] ? pairs[i] : neighbour;
    const OrientedPoint* q = map.nearest(R * p.point + t, normal, radius, guess);
    pairs[i] = q;
    if (!q) continue;
    neighbour = q;
    const Eigen::Vector2d n_scan = R.transpose() * q->normal;
    const double e = q->normal.dot(R * p.point + t - q->point);
    const double variance = p.sigma * p.sigma + q->sigma * q->sigma;
    const double chi = e * e / (variance * scale * scale);
    const double weight = 1 / (variance * (1 + chi / 4));
    const Eigen::Vector3d J(n_scan.x(), n_scan.y(),
                            n_scan.y() * p.point.x() - n_scan.x() * p.point.y());
    s.H += weight * J * J.transpose();
    s.b -= weight * e * J;
    if (std::abs(e) < std::max(0.05, inlier_sigmas * std::sqrt(variance))) {
      ++s.inliers;
      s.square_sum += e * e;
    }
  }
  return s;
}

/// H and b without the directions in which H holds less than `least`; yaw is brought to metres by
/// the typical lever so that the three can be compared. Returns how many are missing.
int without_weak_directions(Eigen::Matrix3d& H, Eigen::Vector3d& b, double lever, double least) {
  const Eigen::Vector3d unit(1, 1, 1 / lever);
  const Eigen::Matrix3d scaled = unit.asDiagonal() * H * unit.asDiagonal();
  const SymmetricEigen<3> eigen = symmetric_eigen(scaled);
  Eigen::Matrix3d kept = Eigen::Matrix3d::Zero(), held = Eigen::Matrix3d::Zero();
  int missing = 0;
  for (int i = 0; i < 3; ++i) {
    if (eigen.values(i) < least) {
      ++missing;
      continue;
    }
    const Eigen::Matrix3d direction = eigen.vectors.col(i) * eigen.vectors.col(i).transpose();
    held += direction;
    kept += eigen.values(i) * direction;
  }
  if (missing > 0) {
    const Eigen::Vector3d back = unit.cwiseInverse();
    H = back.asDiagonal() * kept * back.asDiagonal();
    b = back.asDiagonal() * held * unit.asDiagonal() * b;
  }
  return missing;
}

double typical_lever(const std::vector<OrientedPoint>& scan) {
  double sum = 0;
  for (const OrientedPoint& p : scan) sum += p.point.norm();
  return scan.empty() ? 1.0 : std::max(0.3, sum / static_cast<double>(scan.size()));
}

double largest_sigma(const std::vector<OrientedPoint>& scan) {
  double sigma = 0;
  for (const OrientedPoint& p : scan) sigma = std::max(sigma, p.sigma);
  return sigma;
}

Eigen::Vector3d tangent(const PlanarPose& from, const PlanarPose& to) {
  const PlanarPose d = from.inverse() * to;
  return {d.x, d.y, d.yaw};
}

// Of what the scan wants (b, by match.information) and the prior.
Eigen::Vector3d newton_step(const LineMatch& match, Eigen::Vector3d b, const PlanarPrior& prior,
                            double lever) {
  const Eigen::Matrix3d weighted = match.prior_weight * prior.information;
  b += weighted * tangent(match.T_map_scan, prior.T_map_scan);
  Eigen::Matrix3d H = match.information + weighted;
  H.diagonal() += Eigen::Vector3d(1, 1, lever * lever) * 1e-3;
  return H.ldlt().solve(b);
}

}  // namespace

double PlanarPrior::weight(const PlanarPose& T) const {
  if (!robust) return 1;
  constexpr double kFreedom = 3, kCauchy = 4;  // the square of its scale, as of scan points
  const Eigen::Vector3d e = tangent(T_map_scan, T);
  return 1 / (1 + e.dot(information * e) / (kFreedom * kCauchy));
}

LineMatchOptions LineMatchOptions::for_noise(double sigma) const {
  constexpr double kSigmas = 3 * 1.42;  // of the difference of two returns
  LineMatchOptions scaled = *this;
  scaled.end_radius = std::max(end_radius, kSigmas * sigma);
  scaled.start_radius = std::max(start_radius, 2 * scaled.end_radius);
  scaled.min_information = std::min(min_information, 1 / (sigma * sigma));
  return scaled;
}

LineMatch match_lines(const PointMap& map, const std::vector<OrientedPoint>& scan,
                      const PlanarPose& start, const PlanarPrior& prior,
                      const LineMatchOptions& stated) {
  LineMatch match;
  match.T_map_scan = start;
  if (map.empty() || scan.empty()) return match;
  const LineMatchOptions options = stated.for_noise(largest_sigma(scan));
  const double lever = typical_lever(scan);
  double radius = options.start_radius;
  std::vector<const OrientedPoint*> pairs(scan.size(), nullptr);
  System s;
  for (int i = 0; i < options.max_iterations; ++i) {
    match.iterations = i + 1;
    const double scale = std::max(1.0, radius / options.end_radius);
    // A third of the points finds the way; all of them measure.
    const std::size_t stride = radius > 2 * options.end_radius && scan.size() > 150 ? 3 : 1;
    s = linearise(map, scan, stride, match.T_map_scan, radius, scale, options.inlier_sigmas, pairs);
    // Directions the scan does not hold stay where they are, or where the prior wants them.
    match.information = s.H / options.samples_per_fact;
    Eigen::Vector3d b = s.b / options.samples_per_fact;
    match.unknown_directions =
        without_weak_directions(match.information, b, lever, options.min_information);
    match.prior_weight = prior.weight(match.T_map_scan);
    const Eigen::Vector3d d = newton_step(match, b, prior, lever);
    if (!d.allFinite()) return LineMatch{.T_map_scan = start};
    match.T_map_scan = match.T_map_scan.boxplus(d);
    const double step = d.head<2>().norm() + lever * std::abs(d.z());
    if (radius <= options.end_radius && step < 2e-4) {
      match.converged = true;
      break;
    }
    radius = std::max(options.end_radius, std::min(0.6 * radius, options.end_radius + 3 * step));
  }
  match.matched = s.oriented > 0 ? static_cast<double>(s.inliers) / s.oriented : 0;
  match.rms = s.inliers > 0 ? std::sqrt(s.square_sum / s.inliers) : 0;
  return match;
}

}  // namespace lamina
