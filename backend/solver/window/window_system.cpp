// Skyline Cholesky of the poses, dense Cholesky of the planes.
#include <lamina/backend/solver/window/window_system.hpp>

#include <cmath>

namespace lamina {
namespace {

// A pivot below this share of its own diagonal is rounding, not evidence.
constexpr double kPivot = 1e-13;
// Stands for an infinite pivot: the direction is held, and sqrt() and division stay finite.
constexpr double kHeld = 1e150;

double dot(const double* a, const double* b, int n) {
  double sum0 = 0, sum1 = 0;
  int k = 0;
  for (; k + 1 < n; k += 2) {
    sum0 += a[k] * b[k];
    sum1 += a[k + 1] * b[k + 1];
  }
  return k < n ? sum0 + sum1 + a[k] * b[k] : sum0 + sum1;
}

}  // namespace

void WindowSystem::reset_gradient() {
  gradient_only_ = true;
  g_.setZero(columns());
}

void WindowSystem::reset(int poses, int planes) {
  gradient_only_ = false;
  poses_ = poses;
  planes_ = planes;
  width_ = static_cast<std::size_t>(6 * poses);
  band_.assign(width_ * width_, 0.0);
  first_.resize(static_cast<std::size_t>(poses));
  for (int i = 0; i < poses; ++i) first_[static_cast<std::size_t>(i)] = i;
  W_.setZero(3 * planes, 6 * poses);
  C_.setZero(3 * planes, 3 * planes);
  g_.setZero(columns());
}

void WindowSystem::reach(int row_block, int column_block) {
  int& first = first_[static_cast<std::size_t>(row_block)];
  first = std::min(first, column_block);
}

void WindowSystem::add_pose_pose(int first, int second, const Eigen::Matrix<double, 6, 6>& J_first,
                                 const Eigen::Matrix<double, 6, 6>& J_second,
                                 const Eigen::Matrix<double, 6, 1>& r) {
  add_pose(first, J_first, r);
  add_pose(second, J_second, r);
  if (gradient_only_) return;
  reach(second, first);
  const Eigen::Matrix<double, 6, 6> cross = J_second.transpose() * J_first;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) pose_entry(6 * second + i, 6 * first + j) += cross(i, j);
  }
}

void WindowSystem::add_pose(int pose, const Eigen::Ref<const Eigen::MatrixXd>& J,
                            const Eigen::Ref<const Eigen::VectorXd>& r) {
  g_.segment<6>(6 * pose) += J.transpose() * r;
  if (gradient_only_) return;
  const Eigen::Matrix<double, 6, 6> H = J.transpose() * J;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j <= i; ++j) pose_entry(6 * pose + i, 6 * pose + j) += H(i, j);
  }
}

void WindowSystem::add_pose_plane(int pose, int plane, const Eigen::Matrix<double, 4, 6>& J_pose,
                                  const Eigen::Matrix<double, 4, 3>& J_plane,
                                  const Eigen::Matrix<double, 4, 1>& r) {
  g_.segment<6>(6 * pose) += J_pose.transpose().lazyProduct(r);
  g_.segment<3>(plane_column(plane)) += J_plane.transpose().lazyProduct(r);
  if (gradient_only_) return;
  const Eigen::Matrix<double, 6, 6> H = J_pose.transpose().lazyProduct(J_pose);
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j <= i; ++j) pose_entry(6 * pose + i, 6 * pose + j) += H(i, j);
  }
  W_.block<3, 6>(3 * plane, 6 * pose) += J_plane.transpose().lazyProduct(J_pose);
  C_.block<3, 3>(3 * plane, 3 * plane) += J_plane.transpose().lazyProduct(J_plane);
}

void WindowSystem::add_plane(int plane, const Eigen::Matrix3d& J, const Eigen::Vector3d& r) {
  g_.segment<3>(plane_column(plane)) += J.transpose() * r;
  if (gradient_only_) return;
  C_.block<3, 3>(3 * plane, 3 * plane) += J.transpose() * J;
}

void WindowSystem::add_dense(const std::vector<int>& at, const Eigen::MatrixXd& H,
                             const Eigen::VectorXd& g) {
  const int n = static_cast<int>(at.size()), border = 6 * poses_;
  for (int j = 0; j < n; ++j) g_(at[static_cast<std::size_t>(j)]) += g(j);
  if (gradient_only_) return;
  // Runs of columns that stay side by side are added as blocks.
  struct Run {
    int from, at, size;
  };
  std::vector<Run> runs;
  for (int k = 0; k < n; ++k) {
    const int to = at[static_cast<std::size_t>(k)];
    if (!runs.empty() && to != border && to == runs.back().at + runs.back().size) {
      ++runs.back().size;
    } else {
      runs.push_back({k, to, 1});
    }
  }
  for (const Run& c : runs) {
    for (const Run& r : runs) {
      if (r.at < c.at) continue;  // the lower triangle
      const auto block = H.block(r.from, c.from, r.size, c.size);
      if (c.at >= border) {
        C_.block(r.at - border, c.at - border, r.size, c.size) += block;
      } else if (r.at >= border) {
        W_.block(r.at - border, c.at, r.size, c.size) += block;
      } else {
        for (int i = 0; i < r.size; ++i) {
          reach((r.at + i) / 6, c.at / 6);
          for (int j = 0; j < c.size && c.at + j <= r.at + i; ++j) {
            pose_entry(r.at + i, c.at + j) += block(i, j);
          }
        }
      }
    }
  }
}

double WindowSystem::pivot(double value, double original) {
  if (value > kPivot * original && original > 0) return std::sqrt(value);
  ++held_;
  return kHeld;
}

namespace {

// Cholesky in place of the lower triangle, left-looking, in panels of columns; pivot(value, column)
// gives the root of a pivot.
template <class Pivot>
void factor_in_panels(Eigen::MatrixXd& C, const Pivot& pivot) {
  constexpr int kPanel = 24;
  const int n = static_cast<int>(C.rows());
  for (int begin = 0; begin < n; begin += kPanel) {
    const int width = std::min(kPanel, n - begin), rest = n - begin;
    if (begin > 0) {
      C.block(begin, begin, rest, width).noalias() -=
          C.block(begin, 0, rest, begin) * C.block(begin, 0, width, begin).transpose();
    }
    for (int j = begin; j < begin + width; ++j) {
      auto tail = C.col(j).tail(n - j);
      if (j > begin) {
        tail.noalias() -=
            C.block(j, begin, n - j, j - begin) * C.row(j).segment(begin, j - begin).transpose();
      }
      const double p = pivot(tail(0), j);
      tail(0) = p;
      if (n - j > 1) tail.tail(n - j - 1) /= p;
    }
  }
}

}  // namespace

bool WindowSystem::factor(double lambda) {
  held_ = 0;
  if (!g_.allFinite()) return false;
  band_factor_ = band_;
  W_factor_ = W_;
  C_factor_ = C_;
  const int np = 6 * poses_, nl = 3 * planes_;
  // Poses: row by row, each from its first neighbour.
  for (int i = 0; i < np; ++i) {
    double* row = band_factor_.data() + static_cast<std::size_t>(i) * width_;
    const double original = row[i];
    row[i] += lambda * original;
    const int start = 6 * first_[static_cast<std::size_t>(i / 6)];
    for (int j = start; j <= i; ++j) {
      const double* other = band_factor_.data() + static_cast<std::size_t>(j) * width_;
      const int s = std::max(start, 6 * first_[static_cast<std::size_t>(j / 6)]);
      const double value = row[j] - dot(row + s, other + s, j - s);
      row[j] = j < i ? value / other[j] : pivot(value, original);
    }
  }
  for (int i = 0; i < np && nl > 0; ++i) {
    const double* row = band_factor_.data() + static_cast<std::size_t>(i) * width_;
    for (int j = 6 * first_[static_cast<std::size_t>(i / 6)]; j < i; ++j) {
      W_factor_.col(i) -= row[j] * W_factor_.col(j);
    }
    W_factor_.col(i) /= row[i];
  }
  const Eigen::VectorXd diagonal = C_.diagonal();
  C_factor_.diagonal() += lambda * diagonal;
  if (np > 0 && nl > 0) {
    C_factor_.selfadjointView<Eigen::Lower>().rankUpdate(W_factor_, -1.0);
  }
  // Planes, with the same hold on directions without evidence.
  factor_in_panels(C_factor_, [&](double value, int j) { return pivot(value, diagonal(j)); });
  return C_factor_.diagonal().allFinite() && W_factor_.allFinite();
}

Eigen::MatrixXd WindowSystem::solve(Eigen::MatrixXd B) const {
  const int np = 6 * poses_, nl = 3 * planes_;
  for (Eigen::Index c = 0; c < B.cols(); ++c) {
    double* b = B.col(c).data();
    for (int i = 0; i < np; ++i) {
      const double* row = band_factor_.data() + static_cast<std::size_t>(i) * width_;
      const int start = 6 * first_[static_cast<std::size_t>(i / 6)];
      b[i] = (b[i] - dot(row + start, b + start, i - start)) / row[i];
    }
  }
  if (nl > 0) {
    const auto lower = C_factor_.triangularView<Eigen::Lower>();
    B.bottomRows(nl) -= W_factor_ * B.topRows(np);
    lower.solveInPlace(B.bottomRows(nl));
    lower.transpose().solveInPlace(B.bottomRows(nl));
    B.topRows(np) -= W_factor_.transpose() * B.bottomRows(nl);
  }
  for (Eigen::Index c = 0; c < B.cols(); ++c) {
    double* b = B.col(c).data();
    for (int i = np - 1; i >= 0; --i) {
      const double* row = band_factor_.data() + static_cast<std::size_t>(i) * width_;
      b[i] /= row[i];
      for (int j = 6 * first_[static_cast<std::size_t>(i / 6)]; j < i; ++j) b[j] -= row[j] * b[i];
    }
  }
  return B;
}

Eigen::Matrix3d WindowSystem::plane_block(int plane) const {
  // Only the rows from the plane's own on are touched by forward substitution.
  const Eigen::Index at = 3 * plane, rest = 3 * planes_ - at;
  Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(rest, 3);
  unit.topRows<3>().setIdentity();
  const auto lower = C_factor_.bottomRightCorner(rest, rest).triangularView<Eigen::Lower>();
  lower.solveInPlace(unit);
  return unit.transpose() * unit;
}

Eigen::VectorXd WindowSystem::step() const { return solve(-g_); }

}  // namespace lamina
