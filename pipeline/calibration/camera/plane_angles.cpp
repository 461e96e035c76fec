// Pairs of planes, square or parallel, as residuals.
#include <lamina/pipeline/calibration/camera/plane_angles.hpp>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <lamina/frontend/depth/depth_distortion.hpp>

namespace lamina {
namespace {

constexpr double kDegree = M_PI / 180;
const double kNear = std::sin(12 * kDegree);  // of a right angle; beyond, none is meant
constexpr double kBuilt = 0.5 * kDegree;      // 1-sigma of angles as they are built
constexpr double kUsual = 0.3;                // px, 1-sigma of a coefficient
constexpr double kMeant = 4;   // chi-squared of an angle, beyond which no usual bend makes it
constexpr double kRobust = 4;  // chi-squared at which a pair counts a quarter (Geman-McClure)
constexpr double kImages = 6;  // as many as all images together count

// One or two angles (rad) that should be zero, their variances and how coefficients change them.
struct Angles {
  int count = 0;
  std::array<double, 2> value{}, variance{};
  std::array<Eigen::RowVectorXd, 2> by_bend;

  double chi_squared() const {
    double sum = 0;
    for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k)
      sum += value[k] * value[k] / variance[k];
    return sum;
  }
};

// A plane's normal without the bend, and dn / dq.
struct Straight {
  Eigen::Vector3d n;
  Eigen::Matrix3d by_q;
};

Straight straighten(const ImagePlane& plane, const Eigen::VectorXd& coefficients) {
  const Eigen::Vector3d q = plane.q - plane.by_bend.leftCols(coefficients.size()) * coefficients;
  const double length = q.norm();
  const Eigen::Vector3d n = q / length;
  return {n, (Eigen::Matrix3d::Identity() - n * n.transpose()) / length};
}

void add_angle(Angles& angles, double value, const ImagePlane& a, const Eigen::RowVector3d& by_qa,
               const ImagePlane& b, const Eigen::RowVector3d& by_qb, Eigen::Index terms) {
  const auto k = static_cast<std::size_t>(angles.count++);
  angles.value[k] = value;
  angles.variance[k] = kBuilt * kBuilt + by_qa * a.covariance * by_qa.transpose() +
                       by_qb * b.covariance * by_qb.transpose();
  angles.by_bend[k] = -by_qa * a.by_bend.leftCols(terms) - by_qb * b.by_bend.leftCols(terms);
}

// Square: n_a . n_b; parallel: n_a less n_b along two tangents, whichever way each looks.
Angles angles_between(const ImagePlane& a, const ImagePlane& b, const Eigen::VectorXd& c) {
  const Straight sa = straighten(a, c), sb = straighten(b, c);
  const double dot = sa.n.dot(sb.n);
  Angles angles;
  if (std::abs(dot) < kNear) {
    add_angle(angles, dot, a, sb.n.transpose() * sa.by_q, b, sa.n.transpose() * sb.by_q, c.size());
  } else if (sa.n.cross(sb.n).norm() < kNear) {
    const double sign = dot > 0 ? 1 : -1;
    const Eigen::Vector3d t1 = sa.n.unitOrthogonal(), t2 = sa.n.cross(t1);
    for (const Eigen::Vector3d& t : {t1, t2}) {
      add_angle(angles, -sign * t.dot(sb.n), a, t.transpose() * sa.by_q, b,
                -sign * t.transpose() * sb.by_q, c.size());
    }
  }
  // A ramp of a few degrees is no floor that a bend has tilted.
  for (int k = 0; k < angles.count; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const double expected =
        angles.variance[i] +
        kUsual * kUsual * angles.by_bend[i].head(DepthDistortion::kAffine).squaredNorm();
    if (angles.value[i] * angles.value[i] > kMeant * expected) return {};
  }
  return angles;
}

}  // namespace

void PlaneAngles::add(std::vector<ImagePlane> image) { images_.push_back(std::move(image)); }

double PlaneAngles::share() const {
  return std::min(1.0, kImages / static_cast<double>(std::max<std::size_t>(1, images_.size())));
}

template <class F>
void PlaneAngles::for_each_pair(const Eigen::VectorXd& coefficients, F f) const {
  for (const auto& planes : images_) {
    for (std::size_t i = 0; i < planes.size(); ++i) {
      for (std::size_t j = i + 1; j < planes.size(); ++j)
        f(angles_between(planes[i], planes[j], coefficients));
    }
  }
}

double PlaneAngles::cost(const Eigen::VectorXd& coefficients) const {
  double sum = 0;
  for_each_pair(coefficients, [&](const Angles& angles) {
    const double chi = angles.chi_squared();
    sum += angles.count == 0 ? kRobust : chi / (1 + chi / kRobust);
  });
  return share() * sum;
}

void PlaneAngles::linearize(const Eigen::VectorXd& coefficients, Eigen::MatrixXd& H,
                            Eigen::VectorXd& g) const {
  for_each_pair(coefficients, [&](const Angles& angles) {
    const double root = 1 / (1 + angles.chi_squared() / kRobust);
    for (std::size_t k = 0; k < static_cast<std::size_t>(angles.count); ++k) {
      const double weight = share() * root * root / angles.variance[k];
      H += weight * angles.by_bend[k].transpose() * angles.by_bend[k];
      g += weight * angles.value[k] * angles.by_bend[k].transpose();
    }
  });
}

}  // namespace lamina
