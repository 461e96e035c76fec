// Sensor frame to body frame, with what the motion between frames adds to the noise.
#include <lamina/backend/association/plane_evidence.hpp>

#include <cmath>

#include <lamina/backend/graph/factors/segment.hpp>
#include <lamina/models/linalg.hpp>

namespace lamina {

namespace {
constexpr double kLevelScan = 0.94;  // cosine: within 20 degrees of the body's z
// A level scanner is never quite level: two degrees put what it sees 10 m off 35 cm too high or too
// low, a lever on which millimetres would lean walls. What its lines are part of is taken to be
// upright on the body, and their points to be at one height.
void level(double height, PlaneEvidence& e) {
  constexpr double kExactly = 1e-9;
  if (std::abs(e.scan_normal_body.z()) > 1 - kExactly) return;
  Eigen::Vector3d n = e.plane_body.normal(), mean = e.moments_body.mean();
  n.z() = 0;
  n.normalize();
  mean.z() = height;
  Eigen::Matrix3d scatter = e.moments_body.scatter();
  scatter.row(2).setZero();
  scatter.col(2).setZero();
  e.moments_body = Moments(e.moments_body.weight(), mean, scatter, e.moments_body.count());
  e.plane_body = Plane(n, n.dot(mean));
  e.scan_normal_body = Eigen::Vector3d(0, 0, e.scan_normal_body.z() > 0 ? 1 : -1);
}

// The same of a body that tilts with the ground: upright on `up`, at one height along it.
void level_about(const Eigen::Vector3d& up, double height, PlaneEvidence& e) {
  const Eigen::Matrix3d flat = Eigen::Matrix3d::Identity() - up * up.transpose();
  const auto at_height = [&](const Eigen::Vector3d& p) {
    return Eigen::Vector3d(flat * p + height * up);
  };
  const Eigen::Vector3d line = e.plane_body.normal().cross(e.scan_normal_body);
  Eigen::Vector3d n = line.cross(up).normalized();
  if (n.dot(e.plane_body.normal()) < 0) n = -n;
  const Eigen::Vector3d mean = at_height(e.moments_body.mean());
  e.moments_body = Moments(e.moments_body.weight(), mean, flat * e.moments_body.scatter() * flat,
                           e.moments_body.count());
  e.plane_body = Plane(n, n.dot(mean));
  e.scan_normal_body = e.scan_normal_body.dot(up) > 0 ? up : Eigen::Vector3d(-up);
}

// The upright plane through all lines of a level scanner, which may have another normal than the
// first one's: least n^T S n among normals in the scan. Unchanged where the moments determine none,
// and for lines of a leaning scanner, whose moments are used as they lie. Images keep the first
// one's normal, which was the better one on tum_fr3_structure_notexture_far (ATE 0.80 cm, 1.17 by
// that of all); why is open.
void fit_plane_to_lines(PlaneEvidence& e) {
  constexpr double kObserved = 10;  // times the information across, along at least
  const Eigen::Matrix3d& S = e.moments_body.scatter();
  if (!e.partial || std::abs(e.scan_normal_body.z()) <= kLevelScan) return;
  if (!S.allFinite() || !e.moments_body.mean().allFinite()) return;
  const Matrix32d B = Plane::tangent_basis(e.scan_normal_body);
  const SymmetricEigen<2> in_scan = symmetric_eigen(Eigen::Matrix2d(B.transpose() * S * B));
  if (!(in_scan.values(1) > kObserved * std::max(0.0, in_scan.values(0)))) return;
  Eigen::Vector3d n = B * in_scan.vectors.col(0);
  if (n.dot(e.plane_body.normal()) < 0) n = -n;
  e.plane_body = Plane(n, n.dot(e.moments_body.mean()));
}

// In the scanner's frame. The noise floor joins where it does for moments of returns.
Moments moments_of_ends(const ScanSegment& s) {
  SegmentFactor ends;
  ends.start_body << s.start, 0;
  ends.end_body << s.end, 0;
  ends.sqrt_information = segment_sqrt_information(s, NoiseFloor{});
  return moments_of(ends, s.count);
}

}  // namespace

PlaneEvidence make_evidence(const PlaneObservation& observation, const SE3& T_body_sensor) {
  PlaneEvidence e;
  e.plane_body = T_body_sensor * observation.plane_sensor;
  e.moments_body = observation.moments_sensor.transformed(T_body_sensor);
  e.floor = observation.floor;
  for (const auto& p : observation.outline_sensor) e.outline_body.push_back(T_body_sensor * p);
  e.votes.floor = observation.kind == PlaneKind::kDominantFloor ? 1 : 0;
  e.votes.sub_dominant = observation.kind == PlaneKind::kSubDominant ? 1 : 0;
  e.votes.obstacle = observation.kind == PlaneKind::kObstacle ? 1 : 0;
  return e;
}

PlaneEvidence make_evidence(const SegmentObservation& observation, const SE3& T_body_sensor,
                            const Eigen::Vector3d& up_body, PartialView form) {
  const ScanSegment& s = observation.segment;
  PlaneEvidence e;
  e.plane_body = T_body_sensor * Plane(s.normal_towards_scanner(), -s.rho);
  const bool ends = form == PartialView::kEndPoints;
  e.moments_body = (ends ? moments_of_ends(s) : s.moments).transformed(T_body_sensor);
  e.floor = observation.floor;
  e.outline_body = {T_body_sensor * Eigen::Vector3d(s.start.x(), s.start.y(), 0),
                    T_body_sensor * Eigen::Vector3d(s.end.x(), s.end.y(), 0)};
  e.partial = true;
  e.scan_normal_body = T_body_sensor.so3() * Eigen::Vector3d::UnitZ();
  // Flat on its own line: lines of a leaning scanner join before anybody knows the plane's normal,
  // and what points scatter across each line must not pull it towards the scans' upright.
  if (std::abs(e.scan_normal_body.z()) > kLevelScan) {
    const bool upright = up_body == Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d& at = T_body_sensor.translation();
    upright ? level(at.z(), e) : level_about(up_body, up_body.dot(at), e);
  } else {
    e.moments_body = e.moments_body.discounted(e.plane_body.normal(), NoiseFloor{});
  }
  return e;
}

std::vector<PlaneEvidence> make_evidence(const Observations& observations, PartialView form) {
  std::vector<PlaneEvidence> result;
  for (const auto& o : observations.planes) {
    result.push_back(make_evidence(o, observations.T_body_sensor));
  }
  for (const auto& o : observations.segments) {
    // A front-end's number that is not one must not stop the mapper.
    const bool finite = std::isfinite(o.segment.rho) && std::isfinite(o.segment.theta);
    PlaneEvidence none;
    none.partial = true;
    result.push_back(
        finite ? make_evidence(o, observations.T_body_sensor, observations.up_body, form) : none);
  }
  return result;
}

void PlaneEvidence::join(const PlaneEvidence& other) {
  moments_body.merge(other.moments_body);
  partial = partial && other.partial;
  if (sensor != other.sensor) sensor = ExtrinsicsId::kNone;
  fit_plane_to_lines(*this);
  floor.sigma_rho = std::min(floor.sigma_rho, other.floor.sigma_rho);
  floor.sigma_tilt = std::min(floor.sigma_tilt, other.floor.sigma_tilt);
  floor.sigma_bend = std::min(floor.sigma_bend, other.floor.sigma_bend);
  votes.floor += other.votes.floor;
  votes.sub_dominant += other.votes.sub_dominant;
  votes.obstacle += other.votes.obstacle;
}

void PlaneViews::join(const PlaneEvidence& view) {
  auto& same = view.partial ? lines_ : full_;
  if (same) {
    same->join(view);
  } else {
    same = view;
  }
}

void PlaneViews::join(const PlaneViews& other) {
  if (other.full_) join(*other.full_);
  if (other.lines_) join(*other.lines_);
}

PlaneEvidence moved(const PlaneEvidence& e, const SE3& T_to_from, const Matrix6d& covariance) {
  const Eigen::Vector3d& n = e.plane_body.normal();
  const Eigen::Vector3d& c = e.moments_body.mean();
  // The centroid moves along the normal by n.v + (c x n).w, the normal by tilt n x w.
  Vector6d along;
  along << n, c.cross(n);
  const double rho_variance = along.dot(covariance * along);
  const Matrix32d B = Plane::tangent_basis(n);
  const Eigen::Matrix2d tilt = B.transpose() * covariance.bottomRightCorner<3, 3>() * B;
  NoiseFloor motion;
  motion.sigma_rho = std::sqrt(std::max(0.0, rho_variance));
  motion.sigma_tilt = std::sqrt(std::max(0.0, tilt.trace() / 2));
  PlaneEvidence result = e;
  result.plane_body = T_to_from * e.plane_body;
  result.moments_body = e.moments_body.discounted(n, motion).transformed(T_to_from);
  for (auto& p : result.outline_body) p = T_to_from * p;
  result.scan_normal_body = T_to_from.so3() * e.scan_normal_body;
  return result;
}

}  // namespace lamina
