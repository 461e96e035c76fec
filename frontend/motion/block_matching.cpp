// Association and sums, block by block.
#include <lamina/frontend/motion/block_matching.hpp>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace lamina {
namespace {

using Vector6f = Eigen::Matrix<float, 6, 1>;

Vector6d angles_to_metres(double lever) {
  Vector6d unit;
  unit << 1, 1, 1, 1 / lever, 1 / lever, 1 / lever;
  return unit;
}

/// Robust weight of a block at T_key_current = (R, t): 1 where it fits exactly, 0 where not at all,
/// nothing where the key frame has no block to compare it with: none in view, or none with a normal
/// unless that counts as `empty_fits_not`.
std::optional<float> agreement(const DepthBlocks& key, const DepthBlock& c,
                               const Eigen::Matrix3f& R, const Eigen::Vector3f& t,
                               const BlockGate& gate, bool empty_fits_not) {
  const Eigen::Vector3f q = R * c.point + t;
  const DepthBlock* under = block_under(key, q);
  if (under && !under->oriented() && empty_fits_not) return 0.0F;
  if (!under || !under->oriented()) return std::nullopt;
  const DepthBlock& k = *under;
  if ((R * c.normal).dot(k.normal) < gate.cosine) return 0.0F;
  const float e = k.normal.dot(q - k.point);
  const float limit =
      gate.sigmas * std::sqrt(c.sigma * c.sigma + k.sigma * k.sigma + gate.surface_variance);
  if (std::abs(e) > limit) return 0.0F;
  const float r = e / (0.5F * limit), root = 1 + r * r;
  return 1 / (root * root);
}

using WeakDirections = std::vector<std::pair<Vector6f, Vector6f>>;

WeakDirections in_float(const std::vector<HardDirection>& hard) {
  WeakDirections weak;
  for (const HardDirection& h : hard) {
    weak.emplace_back(h.tangent.cast<float>(), h.covector.cast<float>());
  }
  return weak;
}

// A block of the key frame that one of the current frame lies on.
struct Association {
  const DepthBlock* key;
  Eigen::Vector3f normal_current;
  float distance;  // m, along the key's normal
  float root;      // of the robust weight's inverse
  float weight;    // 1 / m^2
};

std::optional<Association> associate(const DepthBlocks& key, const DepthBlock& c,
                                     const Eigen::Matrix3f& R, const Eigen::Vector3f& t,
                                     const BlockGate& gate) {
  const Eigen::Vector3f q = R * c.point + t;
  const DepthBlock* under = block_under(key, q);
  if (!under || !under->oriented()) return std::nullopt;
  const DepthBlock& k = *under;
  const Eigen::Vector3f n = R.transpose() * k.normal;
  if (n.dot(c.normal) < gate.cosine) return std::nullopt;
  const float e = k.normal.dot(q - k.point);
  const float variance = c.sigma * c.sigma + k.sigma * k.sigma + gate.surface_variance;
  const float limit = std::max(gate.distance, gate.sigmas * std::sqrt(variance));
  if (std::abs(e) > limit || (q - k.point).squaredNorm() > gate.beside * q.z() * q.z())
    return std::nullopt;
  // Geman-McClure-like: half weight at half the gate.
  const float r = e / (0.5F * limit), root = 1 + r * r;
  return Association{under, n, e, root, 1 / (variance * root * root)};
}

Vector6f point_jacobian(const Eigen::Vector3f& point, const Eigen::Vector3f& normal) {
  const Eigen::Vector3f m = point.cross(normal);
  Vector6f J;
  J << normal.x(), normal.y(), normal.z(), m.x(), m.y(), m.z();
  return J;
}

}  // namespace

void accumulate(const DepthBlocks& key, const DepthBlocks& current, const SE3& T_key_current,
                int stride, const BlockGate& gate, const std::vector<HardDirection>& hard,
                BlockSums& sums) {
  constexpr int kTiltStride = 4;  // of the blocks used: noise of normals is alike in neighbours
  const Eigen::Matrix3f R = T_key_current.so3().matrix().cast<float>();
  const Eigen::Vector3f t = T_key_current.translation().cast<float>();
  const WeakDirections weak = in_float(hard);
  for (int v = 0; v < current.height; v += stride) {
    // Sums of a row in float, of rows in double: fast, and safe.
    Eigen::Matrix<float, 6, 6> H = Eigen::Matrix<float, 6, 6>::Zero(), spurious = H;
    Eigen::Matrix<float, 6, 1> b = Eigen::Matrix<float, 6, 1>::Zero();
    for (int u = 0; u < current.width; u += stride) {
      const DepthBlock& c = current.at(u, v);
      if (!c.oriented()) continue;
      ++sums.tried;
      const auto on = associate(key, c, R, t, gate);
      if (!on) continue;
      const float e = on->distance, w = on->weight, root = on->root;
      Vector6f J = point_jacobian(c.point, on->normal_current);
      for (const auto& [tangent, covector] : weak) {
        const float along = tangent.dot(J);
        if (std::abs(along) < gate.facing) J -= along * covector;
      }
      H.noalias() += (w * J) * J.transpose();
      b -= (w * e) * J;
      sums.agreement += static_cast<double>(1 / (root * root));
      sums.squares += static_cast<double>(e * e);
      if (sums.used++ % kTiltStride != 0) continue;
      const DepthBlock& k = *on->key;
      for (const Eigen::Vector3f& axis : tilt_axes(k)) {
        J = point_jacobian(c.point, R.transpose() * axis);
        spurious.noalias() += (w * kTiltStride * k.tilt * k.tilt * J) * J.transpose();
      }
    }
    sums.H += H.cast<double>();
    sums.b += b.cast<double>();
    sums.spurious += spurious.cast<double>();
  }
}

std::vector<HardDirection> hard_directions(const Matrix6d& H, double lever, double share) {
  const Vector6d unit = angles_to_metres(lever);
  const Matrix6d scaled = unit.asDiagonal() * H * unit.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(scaled);
  std::vector<HardDirection> hard;
  for (int i = 0; i < 6 && eigen.eigenvalues()(i) < share * eigen.eigenvalues()(5); ++i) {
    const Vector6d v = eigen.eigenvectors().col(i);
    hard.push_back({unit.asDiagonal() * v, unit.cwiseInverse().asDiagonal() * v});
  }
  return hard;
}

double gained_agreement(const DepthBlocks& key, const DepthBlocks& current, const SE3& from,
                        const SE3& to, int stride, const BlockGate& gate, bool empty_fits_not) {
  const Eigen::Matrix3f R_from = from.so3().matrix().cast<float>();
  const Eigen::Matrix3f R_to = to.so3().matrix().cast<float>();
  const Eigen::Vector3f t_from = from.translation().cast<float>();
  const Eigen::Vector3f t_to = to.translation().cast<float>();
  double sum = 0;
  int common = 0, all = 0;
  for (int v = 0; v < current.height; v += stride) {
    for (int u = 0; u < current.width; u += stride) {
      const DepthBlock& c = current.at(u, v);
      if (!c.oriented()) continue;
      ++all;
      const auto before = agreement(key, c, R_from, t_from, gate, empty_fits_not);
      const auto after =
          before ? agreement(key, c, R_to, t_to, gate, empty_fits_not) : std::nullopt;
      if (!after) continue;
      sum += static_cast<double>(*after - *before);
      ++common;
    }
  }
  constexpr double kLeastInView = 0.15;  // a corner of the image fits many a place
  return common > kLeastInView * all ? sum / common : 0;
}

double agreement_in_view(const DepthBlocks& key, const DepthBlocks& current,
                         const SE3& T_key_current, int stride, const BlockGate& gate) {
  const Eigen::Matrix3f R = T_key_current.so3().matrix().cast<float>();
  const Eigen::Vector3f t = T_key_current.translation().cast<float>();
  double sum = 0;
  int in_view = 0;
  for (int v = 0; v < current.height; v += stride) {
    for (int u = 0; u < current.width; u += stride) {
      const DepthBlock& c = current.at(u, v);
      if (!c.oriented()) continue;
      const auto one = agreement(key, c, R, t, gate, true);
      if (!one) continue;
      sum += static_cast<double>(*one);
      ++in_view;
    }
  }
  return in_view > 0 ? sum / in_view : 0;
}

std::vector<Vector6d> without_weak_directions(Matrix6d& H, Vector6d& b, const Matrix6d& doubtful,
                                              double lever, double limit) {
  const Vector6d unit = angles_to_metres(lever);
  const Matrix6d sure = unit.asDiagonal() * (H - doubtful) * unit.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(sure);
  Matrix6d held = Matrix6d::Zero();
  std::vector<Vector6d> missing;
  for (int i = 0; i < 6; ++i) {
    const Vector6d direction = eigen.eigenvectors().col(i);
    if (eigen.eigenvalues()(i) >= limit) {
      held += direction * direction.transpose();
    } else {
      missing.push_back(unit.asDiagonal() * direction);
    }
  }
  if (!missing.empty()) {
    // Tangents without their part in the missing directions.
    const Matrix6d keep = unit.cwiseInverse().asDiagonal() * held * unit.asDiagonal();
    H = keep * H * keep.transpose();
    b = keep * b;
  }
  return missing;
}

}  // namespace lamina
