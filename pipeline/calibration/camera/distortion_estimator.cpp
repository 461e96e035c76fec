// Normal equations of the bend, plane by plane.
#include <lamina/pipeline/calibration/camera/distortion_estimator.hpp>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <vector>

namespace lamina {
namespace {

constexpr int kColumns = 40;          // blocks across the image
constexpr std::int64_t kShare = 100;  // planes of at least a hundredth of the image
// Blocks of one image err alike, so their number says little: a coefficient of 1 px is as unlikely
// as this share of all residuals being a few hundredths. It holds corners nobody saw.
constexpr double kRidge = 1e-3;

// Sums of one block for one plane.
struct Mean {
  double u = 0, v = 0, d = 0, n = 0;
};

// How an image is cut into blocks.
struct BlockLayout {
  int side, columns, rows;
};

// Of every plane's pixels by blocks, row-major; empty: the plane is too small.
std::vector<std::vector<Mean>> sums_of_blocks(const FloorResult& floor,
                                              const DisparityImage& disparities,
                                              const BlockLayout& layout) {
  const auto [side, columns, rows] = layout;
  const auto per_plane = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  const auto pixels = static_cast<std::int64_t>(floor.pixel_labels.size());
  std::vector<std::vector<Mean>> planes(floor.planes.size());
  for (std::size_t k = 0; k < planes.size(); ++k) {
    if (floor.planes[k].pixels * kShare >= pixels) planes[k].resize(per_plane);
  }
  for (int v = 0; v < rows * side; ++v) {
    const float* d = disparities.row(v);
    for (int u = 0; u < columns * side; ++u) {
      const int k = floor.plane_at(u, v, disparities.width);
      if (k < 0 || !(d[u] > 0) || planes[static_cast<std::size_t>(k)].empty()) continue;
      Mean& m = planes[static_cast<std::size_t>(k)]
                      [static_cast<std::size_t>(v / side * columns + u / side)];
      m.u += u;
      m.v += v;
      m.d += static_cast<double>(d[u]);
      ++m.n;
    }
  }
  return planes;
}

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

// Blocks that hold something else beside the plane go.
void drop_mixed_blocks(Eigen::MatrixXd& xyd) {
  constexpr double kGate = 3, kFinest = 0.03;  // rms; px
  const Eigen::VectorXd r = residuals(span_of_planes(xyd), xyd.col(2));
  const double rms = std::sqrt(r.squaredNorm() / static_cast<double>(xyd.rows()));
  const double gate = kGate * std::max(kFinest, rms);
  Eigen::Index kept = 0;
  for (Eigen::Index i = 0; i < xyd.rows(); ++i) {
    if (std::abs(r(i)) < gate) xyd.row(kept++) = xyd.row(i).eval();
  }
  xyd.conservativeResize(kept, Eigen::NoChange);
}

// Rays (x, y, 1) through the middles of blocks, a row each.
Eigen::MatrixX3d rays(const Eigen::MatrixXd& xyd, const CameraModel& camera, int width,
                      int height) {
  Eigen::MatrixX3d result(xyd.rows(), 3);
  const auto pixels = [](const auto& along, int size) {
    return 0.5 * (size * (along.array() + 1) - 1);
  };
  result.col(0) = (pixels(xyd.col(0), width) - camera.cx) / camera.fx;
  result.col(1) = (pixels(xyd.col(1), height) - camera.cy) / camera.fy;
  result.col(2).setOnes();
  return result;
}

// Least squares of disparities over rays, and the same of the bend's basis.
ImagePlane seen_plane(const Eigen::MatrixX3d& rays, const Eigen::VectorXd& d,
                      const Eigen::MatrixXd& basis) {
  // What no smooth bend explains, px, and blocks that it makes err apart.
  constexpr double kLeft = 0.05, kApart = 12;
  const Eigen::Matrix3d N = rays.transpose() * rays;
  const auto inverse = N.ldlt();
  ImagePlane plane;
  plane.q = inverse.solve(rays.transpose() * d);
  plane.by_bend = inverse.solve(rays.transpose() * basis);
  plane.covariance = kLeft * kLeft * std::max(1.0, static_cast<double>(rays.rows()) / kApart) *
                     inverse.solve(Eigen::Matrix3d::Identity());
  return plane;
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
  constexpr int kAffine = DepthDistortion::kAffine;
  const int bent = terms - kAffine;
  Eigen::MatrixXd M = A.block(kAffine, kAffine, bent, bent);
  M.diagonal().array() += kRidge * samples;
  Eigen::VectorXd c = Eigen::VectorXd::Zero(terms);
  c.tail(bent) = M.ldlt().solve(b.segment(kAffine, bent));
  return c;
}

double DistortionEstimator::Half::left_by(const Eigen::VectorXd& c) const {
  const Eigen::Index n = c.size();
  return (square - 2 * c.dot(b.head(n)) + c.dot(A.topLeftCorner(n, n) * c)) / samples;
}

void DistortionEstimator::add(const FloorResult& floor, const DisparityImage& disparities,
                              const CameraModel& camera) {
  const int width = disparities.width, height = disparities.height;
  if (width_ == 0) {
    width_ = width;
    height_ = height;
    side_ = std::max(4, width / kColumns);
    columns_ = width / side_;
    seen_.assign(static_cast<std::size_t>(columns_ * (height / side_)), 0);
  }
  const BlockLayout layout{side_, columns_, height / side_};
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  if (width != width_ || height != height_ || layout.columns == 0 || layout.rows == 0 ||
      floor.pixel_labels.size() != pixels) {
    return;
  }
  Half& half = halves_[static_cast<std::size_t>(frames_ / kTurn % 2)];
  ++frames_;
  std::vector<ImagePlane> seen;
  for (const std::vector<Mean>& blocks : sums_of_blocks(floor, disparities, layout)) {
    std::vector<Eigen::Vector3d> means;
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      const Mean& m = blocks[i];
      if (2 * m.n < side_ * side_) continue;
      ++seen_[i];
      means.emplace_back((2 * m.u / m.n + 1) / width - 1, (2 * m.v / m.n + 1) / height - 1,
                         m.d / m.n);
    }
    if (auto plane = add_plane(means, camera, half)) seen.push_back(std::move(*plane));
  }
  angles_.add(std::move(seen));
}

// With Q an orthonormal basis of all planes over the blocks, the part of disparities and bends that
// no plane explains is (I - Q Q^T) times them.
std::optional<ImagePlane> DistortionEstimator::add_plane(const std::vector<Eigen::Vector3d>& means,
                                                         const CameraModel& camera,
                                                         Half& half) const {
  constexpr std::size_t kFewest = 12;           // blocks
  constexpr Eigen::Index kFewestOfAngles = 20;  // small planes lean with anything
  if (means.size() < kFewest) return std::nullopt;
  Eigen::MatrixXd xyd(static_cast<Eigen::Index>(means.size()), 3);
  for (Eigen::Index i = 0; i < xyd.rows(); ++i) {
    xyd.row(i) = means[static_cast<std::size_t>(i)].transpose();
  }
  drop_mixed_blocks(xyd);
  const Eigen::Index kept = xyd.rows();
  if (kept < static_cast<Eigen::Index>(kFewest)) return std::nullopt;
  const Eigen::MatrixXd Q = span_of_planes(xyd);
  Eigen::MatrixXd B(kept, kTerms);
  for (Eigen::Index i = 0; i < kept; ++i) {
    B.row(i) = DepthDistortion::basis(xyd(i, 0), xyd(i, 1), DepthDistortion::kMaxDegree);
  }
  const Eigen::MatrixXd left = B - Q * (Q.transpose() * B);
  const Eigen::VectorXd r = residuals(Q, xyd.col(2));
  half.A += left.transpose() * left;
  half.b += left.transpose() * r;
  half.square += r.squaredNorm();
  half.samples += static_cast<double>(kept - 3);
  if (kept < kFewestOfAngles) return std::nullopt;
  return seen_plane(rays(xyd, camera, width_, height_), xyd.col(2), B);
}

int DistortionEstimator::degree_by_planes() const {
  // Of the mean square left in the half that did not teach, this much must go with each step.
  constexpr double kMarked = 0.05;
  std::array<double, 2> left{halves_[0].left_by({}), halves_[1].left_by({})};
  int degree = 0;
  for (const int next : {2, 4, 6, 8, 10, 12, 14}) {
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
  return degree;
}

namespace {
// Of chi-squared, where planes tell a bend, which hardly ever comes without slopes, and where they
// tell none.
double least_gain_of_angles(int terms) {
  constexpr double kGainOfBent = 4, kGainOfStraight = 8;
  return terms > DepthDistortion::kAffine ? kGainOfBent : kGainOfStraight;
}
}  // namespace

// Planes and angles together, from what planes alone say; nullopt where angles gain little by it.
std::optional<Eigen::VectorXd> DistortionEstimator::with_angles(const Half& all, int terms) const {
  // px, 1-sigma of a coefficient: what the ridge stands for; of what angles leave, or else most is
  // built askew.
  constexpr double kUsual = 0.3, kLeastShare = 0.25;
  // Sigmas: a constant scales all distances, and most sensors have none.
  constexpr double kObservedConstant = 4;
  const double scale = 1 / (kUsual * kUsual * kRidge * all.samples);
  const Eigen::VectorXd start = all.solve(terms), b = scale * all.b.head(terms);
  const double askew = angles_.cost(start);
  Eigen::MatrixXd H_planes = scale * all.A.topLeftCorner(terms, terms);
  H_planes.diagonal().array() += 1 / (kUsual * kUsual);
  const auto cost = [&](const Eigen::VectorXd& c) {
    return c.dot(H_planes * c) - 2 * b.dot(c) + angles_.cost(c);
  };
  Eigen::MatrixXd H;
  const auto solve = [&] {
    constexpr int kSteps = 12;
    Eigen::VectorXd c = start;
    for (int step = 0; step < kSteps; ++step) {
      H = H_planes;
      Eigen::VectorXd g = H_planes * c - b;
      angles_.linearize(c, H, g);
      c -= H.ldlt().solve(g);
    }
    return c;
  };
  Eigen::VectorXd c = solve();
  const Eigen::VectorXd of_constant = H.ldlt().solve(Eigen::VectorXd::Unit(terms, 0));
  if (c(0) * c(0) < kObservedConstant * kObservedConstant * of_constant(0)) {
    constexpr double kNone = 1e-3;  // px
    H_planes(0, 0) += 1 / (kNone * kNone);
    c = solve();
  }
  if (!c.allFinite() || !(cost(c) < cost(start) - least_gain_of_angles(terms)) ||
      !(angles_.cost(c) < (1 - kLeastShare) * askew)) {
    return std::nullopt;
  }
  return c;
}

// Polynomials run away where nothing was seen: there they are held to their values elsewhere.
DepthDistortion DistortionEstimator::distortion_of(const Eigen::VectorXd& coefficients) const {
  constexpr int kOften = 5;  // frames
  DepthDistortion result(width_, height_, coefficients);
  double low = 0, high = 0;
  for (std::size_t i = 0; i < seen_.size(); ++i) {
    if (seen_[i] < kOften) continue;
    const int block = static_cast<int>(i);
    const int u = (2 * (block % columns_) + 1) * side_ / 2;
    const int v = (2 * (block / columns_) + 1) * side_ / 2;
    const auto e = static_cast<double>(result.field()[static_cast<std::size_t>(v * width_ + u)]);
    low = std::min(low, e);
    high = std::max(high, e);
  }
  result.hold_within(low, high);
  return result;
}

std::optional<DepthDistortion> DistortionEstimator::estimate() const {
  if (frames_ < kLeast || !(halves_[0].samples > 0) || !(halves_[1].samples > 0)) {
    return std::nullopt;
  }
  const int degree = degree_by_planes();
  Half all = halves_[0];
  all += halves_[1];
  if (const auto c = with_angles(all, DepthDistortion::terms(std::max(1, degree))))
    return distortion_of(*c);
  if (degree == 0) return std::nullopt;
  return distortion_of(all.solve(DepthDistortion::terms(degree)));
}

}  // namespace lamina
