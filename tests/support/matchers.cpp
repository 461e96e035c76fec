// How our types are printed and compared in tests.
#include "support/matchers.hpp"

#include <cmath>
#include <limits>
#include <ostream>
#include <sstream>

namespace lamina {
namespace {
const Eigen::IOFormat kRow(12, 0, ", ", "; ", "", "", "(", ")");

std::string row(const Eigen::MatrixXd& m) {
  std::ostringstream out;
  out << m.transpose().format(kRow);
  return out.str();
}
}  // namespace

void PrintTo(const SO3& R, std::ostream* out) {
  *out << "SO3 xyzw " << row(R.quaternion().coeffs()) << " = exp " << row(R.log());
}

void PrintTo(const SE3& T, std::ostream* out) {
  *out << "SE3 t " << row(T.translation()) << " xyzw " << row(T.so3().quaternion().coeffs());
}

void PrintTo(const Plane& plane, std::ostream* out) {
  *out << "Plane n " << row(plane.normal()) << " rho " << plane.rho();
}

void PrintTo(const Moments& moments, std::ostream* out) {
  *out << "Moments w " << moments.weight() << " mean " << row(moments.mean()) << " count "
       << moments.count() << " scatter " << row(moments.scatter());
}

namespace test {
namespace {
Difference of(const Eigen::MatrixXd& d) {
  // maxCoeff does not promise to hand NaN on.
  const double largest = d.allFinite() ? (d.size() ? d.cwiseAbs().maxCoeff() : 0.0) : std::nan("");
  return {largest, row(d)};
}
}  // namespace

Difference difference(const SO3& a, const SO3& b) { return of((a.inverse() * b).log()); }

Difference difference(const SE3& a, const SE3& b) { return of((a.inverse() * b).log()); }

Difference difference(const Plane& a, const Plane& b) { return of(a.boxminus(b)); }

Difference difference(const Moments& a, const Moments& b) {
  const double weight = std::max(std::abs(b.weight()), std::numeric_limits<double>::min());
  const double scatter = std::max(b.scatter().cwiseAbs().maxCoeff(), 1e-300);
  Eigen::VectorXd d(14);
  d(0) = (a.weight() - b.weight()) / weight;
  d.segment<3>(1) = a.mean() - b.mean();
  const Eigen::Matrix3d ds = (a.scatter() - b.scatter()) / scatter;
  d.segment<9>(4) = Eigen::Map<const Eigen::Matrix<double, 9, 1>>(ds.data());
  d(13) = static_cast<double>(a.count() - b.count());
  return of(d);
}

Difference difference(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  if (a.rows() != b.rows() || a.cols() != b.cols()) {
    return {std::numeric_limits<double>::infinity(), "sizes"};
  }
  return of(a - b);
}

}  // namespace test
}  // namespace lamina
