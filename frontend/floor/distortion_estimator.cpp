// Normal equations of the bend, plane by plane.
#include <lamina/frontend/floor/distortion_estimator.hpp>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <vector>

namespace lamina {
namespace {

constexpr int kColumns = 40;          // blocks across the image
constexpr std::int64_t kShare = 100;  // planes of at least a hundredth of the image

// Sums of one block for one plane.
struct Mean {
  double u = 0, v = 0, d = 0, n = 0;
};

// Orthonormal columns that span (x, y, 1) over the blocks.
Eigen::MatrixXd span_of_planes(const Eigen::MatrixXd& xyd) {
  Eigen::MatrixXd A(xyd.rows(), 3);
  A << xyd.leftCols(2), Eigen::VectorXd::Ones(xyd.rows());
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(A);
  return qr.householderQ() * Eigen::MatrixXd::Identity(xyd.rows(), 3);
}

Eigen::VectorXd residuals(const Eigen::MatrixXd& Q, const Eigen::VectorXd& d) {
  return d - Q * (Q.transpose() * d);
}

}  // namespace

DistortionEstimator::Half& DistortionEstimator::Half::operator+=(const Half& o) {
  A += o.A;
  b += o.b;
  square += o.square;
  samples += o.samples;
  return *this;
}

Eigen::VectorXd DistortionEstimator::Half::solve(int terms) const {
  // Blocks of one image err alike, so their number says little: a coefficient of 1 px is as
  // unlikely as this share of all residuals being a few hundredths. It holds corners nobody saw.
  constexpr double kRidge = 1e-3;
  Eigen::MatrixXd M = A.topLeftCorner(terms, terms);
  M.diagonal().array() += kRidge * samples;
  return M.ldlt().solve(b.head(terms));
}

double DistortionEstimator::Half::left_by(const Eigen::VectorXd& c) const {
  const Eigen::Index n = c.size();
  return (square - 2 * c.dot(b.head(n)) + c.dot(A.topLeftCorner(n, n) * c)) / samples;
}

void DistortionEstimator::add(const FloorResult& floor, const DisparityImage& disparities) {
  const int width = disparities.width, height = disparities.height;
  if (width_ == 0) {
    width_ = width;
    height_ = height;
  }
  const int side = std::max(4, width / kColumns);
  const int columns = width / side, rows = height / side;
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  if (width != width_ || height != height_ || columns == 0 || rows == 0 ||
      floor.pixel_labels.size() != pixels) {
    return;
  }
  Half& half = halves_[static_cast<std::size_t>(frames_ / kTurn % 2)];
  ++frames_;
  const auto per_plane = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  std::vector<std::vector<Mean>> planes(floor.planes.size());  // empty: too small
  for (std::size_t k = 0; k < planes.size(); ++k) {
    if (floor.planes[k].pixels * kShare >= static_cast<std::int64_t>(pixels))
      planes[k].resize(per_plane);
  }
  for (int v = 0; v < rows * side; ++v) {
    const float* d = disparities.row(v);
    for (int u = 0; u < columns * side; ++u) {
      const int k = floor.plane_at(u, v, width);
      if (k < 0 || !(d[u] > 0) || planes[static_cast<std::size_t>(k)].empty()) continue;
      Mean& m = planes[static_cast<std::size_t>(k)]
                      [static_cast<std::size_t>(v / side * columns + u / side)];
      m.u += u;
      m.v += v;
      m.d += static_cast<double>(d[u]);
      ++m.n;
    }
  }
  for (const std::vector<Mean>& blocks : planes) {
    std::vector<Eigen::Vector3d> means;
    for (const Mean& m : blocks) {
      if (2 * m.n < side * side) continue;
      means.emplace_back((2 * m.u / m.n + 1) / width - 1, (2 * m.v / m.n + 1) / height - 1,
                         m.d / m.n);
    }
    add_plane(means, half);
  }
}

// With Q an orthonormal basis of all planes over the blocks, the part of disparities and bends that
// no plane explains is (I - Q Q^T) times them.
void DistortionEstimator::add_plane(const std::vector<Eigen::Vector3d>& means, Half& half) const {
  constexpr std::size_t kFewest = 12;  // blocks
  if (means.size() < kFewest) return;
  Eigen::MatrixXd xyd(static_cast<Eigen::Index>(means.size()), 3);
  for (Eigen::Index i = 0; i < xyd.rows(); ++i) {
    xyd.row(i) = means[static_cast<std::size_t>(i)].transpose();
  }
  // Blocks that hold something else beside the plane go.
  constexpr double kGate = 3, kFinest = 0.03;  // rms; px
  const Eigen::VectorXd first = residuals(span_of_planes(xyd), xyd.col(2));
  const double rms = std::sqrt(first.squaredNorm() / static_cast<double>(means.size()));
  const double gate = kGate * std::max(kFinest, rms);
  Eigen::Index kept = 0;
  for (Eigen::Index i = 0; i < xyd.rows(); ++i) {
    if (std::abs(first(i)) < gate) xyd.row(kept++) = xyd.row(i).eval();
  }
  if (kept < static_cast<Eigen::Index>(kFewest)) return;
  xyd.conservativeResize(kept, Eigen::NoChange);
  const Eigen::MatrixXd Q = span_of_planes(xyd);
  Eigen::MatrixXd B(kept, kTerms);
  for (Eigen::Index i = 0; i < kept; ++i) {
    B.row(i) = DepthDistortion::basis(xyd(i, 0), xyd(i, 1), DepthDistortion::kMaxDegree);
  }
  B -= Q * (Q.transpose() * B).eval();
  const Eigen::VectorXd r = residuals(Q, xyd.col(2));
  half.A += B.transpose() * B;
  half.b += B.transpose() * r;
  half.square += r.squaredNorm();
  half.samples += static_cast<double>(kept - 3);
}

std::optional<DepthDistortion> DistortionEstimator::estimate() const {
  if (frames_ < kLeast || !(halves_[0].samples > 0) || !(halves_[1].samples > 0)) {
    return std::nullopt;
  }
  // Of the mean square left in the half that did not teach, this much must go with each step.
  constexpr double kMarked = 0.05;
  std::array<double, 2> left{halves_[0].left_by({}), halves_[1].left_by({})};
  int degree = 0;
  for (const int next : {2, 4, 6}) {
    const int terms = DepthDistortion::terms(next);
    const std::array<double, 2> now{halves_[0].left_by(halves_[1].solve(terms)),
                                    halves_[1].left_by(halves_[0].solve(terms))};
    if (!(now[0] < left[0] && now[1] < left[1] &&
          now[0] + now[1] < (1 - kMarked) * (left[0] + left[1]))) {
      continue;
    }
    degree = next;
    left = now;
  }
  if (degree == 0) return std::nullopt;
  Half all = halves_[0];
  all += halves_[1];
  return DepthDistortion(width_, height_, all.solve(DepthDistortion::terms(degree)));
}

}  // namespace lamina
