// Normal equations of a sliding window, and their Cholesky factor in the shape such windows have.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace lamina {

/// H d = -g for P poses (6 each, in time order) followed by L planes (3 each). Poses are tied to
/// their neighbours, so their part is a narrow band (a skyline: every row starts at its first
/// neighbour); planes see many poses and, through the marginal prior, each other: their part is
/// dense. The factor is H = L L^T, L = [Lp 0; W Ll]. Multiplications: 36 P b + 18 L P b + 27 L^2 P
/// + 4.5 L^3, b the poses of a row: bench/window_bench.cpp.
class WindowSystem {
 public:
  /// Zero everything for a new linearisation.
  void reset(int poses, int planes);
  /// Zeroes the gradient alone, for the same states: what is added from here on adds to it alone,
  /// and the factor stays that of the equations before. Ends with the next reset().
  void reset_gradient();
  int poses() const { return poses_; }
  int planes() const { return planes_; }
  int columns() const { return 6 * poses_ + 3 * planes_; }
  static int pose_column(int pose) { return 6 * pose; }
  int plane_column(int plane) const { return 6 * poses_ + 3 * plane; }

  /// Adds J^T J and J^T r of a whitened residual between two poses (first <= second; equal: one).
  void add_pose_pose(int first, int second, const Eigen::Matrix<double, 6, 6>& J_first,
                     const Eigen::Matrix<double, 6, 6>& J_second,
                     const Eigen::Matrix<double, 6, 1>& r);
  void add_pose(int pose, const Eigen::Ref<const Eigen::MatrixXd>& J,
                const Eigen::Ref<const Eigen::VectorXd>& r);
  void add_pose_plane(int pose, int plane, const Eigen::Matrix<double, 4, 6>& J_pose,
                      const Eigen::Matrix<double, 4, 3>& J_plane,
                      const Eigen::Matrix<double, 4, 1>& r);
  void add_plane(int plane, const Eigen::Matrix3d& J, const Eigen::Vector3d& r);
  /// A dense H = R^T R over any of the blocks: `columns[k]` is where column k of R goes.
  void add_dense(const std::vector<int>& columns, const Eigen::MatrixXd& H,
                 const Eigen::VectorXd& g);

  /// Factors H + lambda diag(H). A pivot that is not positive (no evidence in that direction) is
  /// held instead: its step is zero, and held() counts it. False when anything is not finite.
  bool factor(double lambda = 0);
  int held() const { return held_; }
  /// d = -H^-1 g; needs factor().
  Eigen::VectorXd step() const;
  const Eigen::VectorXd& gradient() const { return g_; }
  /// H^-1 B for any number of right-hand sides; needs factor().
  Eigen::MatrixXd solve(Eigen::MatrixXd B) const;

  /// The 3x3 block of H^-1 of one plane; needs factor(). Planes come last in the factor: nothing of
  /// the poses is touched.
  Eigen::Matrix3d plane_block(int plane) const;
  /// The diagonal blocks of H^-1 of every state; needs factor().
  struct Blocks {
    std::vector<Eigen::Matrix<double, 6, 6>> poses;
    std::vector<Eigen::Matrix3d> planes;
  };
  Blocks inverse_blocks() const;

 private:
  double& pose_entry(int row, int column) {
    return band_[static_cast<std::size_t>(row) * width_ + static_cast<std::size_t>(column)];
  }
  double pose_entry(int row, int column) const {
    return band_[static_cast<std::size_t>(row) * width_ + static_cast<std::size_t>(column)];
  }
  void reach(int row_block, int column_block);
  double pivot(double value, double original);

  int poses_ = 0, planes_ = 0, held_ = 0;
  bool gradient_only_ = false;
  std::size_t width_ = 0;
  std::vector<double> band_, band_factor_;  ///< lower triangle of the poses, by rows
  std::vector<int> first_;                  ///< by pose: the first pose its rows reach
  Eigen::MatrixXd W_, W_factor_;            ///< planes x poses
  Eigen::MatrixXd C_, C_factor_;            ///< planes x planes, lower
  Eigen::VectorXd g_;
};

}  // namespace lamina
