// Whether what a recording suggests of its own sensors may replace what was stated.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include <lamina/models/timestamp.hpp>

namespace lamina {

/// Errors of neighbouring frames are shared (a slip, a bent image, a swell of the floor), so the
/// sigma that least squares states is too small, and a test by it adopts what is not there. Here a
/// recording is cut into blocks longer than such errors last, each is left out in turn, and an
/// estimate is adopted where what was left out fits better by the estimate made without it than by
/// the stated value (cross-validation; blocks as in [Kuensch1989]).
struct AdoptionOptions {
  double block_s = 4;       ///< s; slips and swells last for some 3 s
  int least_blocks = 8;     ///< fewer state no spread of their own
  double least_gain = 9;    ///< chi-squared, over all blocks
  double least_sigmas = 1;  ///< the mean gain over its own sigma
};

/// What the test gave.
struct Adoption {
  int blocks = 0;
  double gain = 0;  ///< sum of c(block | stated) - c(block | estimate without it), truncated costs
  double sigmas = 0;  ///< the mean gain over its own sigma
  bool adopted = false;
};

/// Running sums of blocks' gains: those of a recording, or of a drive that goes on.
class BlockGains {
 public:
  void add(double gain);
  Adoption judge(const AdoptionOptions& options = {}) const;

  /// For archives (models/archive.hpp).
  template <class A>
  friend void fields(A& a, BlockGains& v) {
    a(v.count_, v.sum_, v.squares_);
  }

 private:
  std::int64_t count_ = 0;
  double sum_ = 0, squares_ = 0;
};

/// The same of a whole list.
Adoption judge(const std::vector<double>& gains, const AdoptionOptions& options = {});

/// Student's t of `dof` that 0.27 % exceed (two sides; three sigmas of many): by so many jackknife
/// sigmas an estimate must lie off what was stated, too. By its Cornish-Fisher expansion.
double student_quantile(double dof);

/// The jackknife's covariance of an estimate from those with one of the blocks left out each.
Eigen::MatrixXd jackknife_covariance(const std::vector<Eigen::VectorXd>& left_out);
double jackknife_sigma(const std::vector<double>& left_out);

/// What one block says of parameters p, all else solved for: cost(p) = p^T H p - 2 b^T p + const.
struct QuadraticBlock {
  Eigen::MatrixXd H;
  Eigen::VectorXd b;
};

struct JudgedBlocks {
  Eigen::VectorXd value;  ///< by all blocks, with the prior of what is asked
  Eigen::MatrixXd covariance;
  Adoption adoption;
};

/// The test of those free with prior information `asked` and not with `stated` (held about zero by
/// much of it): that of AdoptionOptions, and off zero by Student's t of the blocks in one of them.
/// Costs are in units of the mean square by which blocks differ from each other per parameter that
/// they observe (tr (H + asked)^-1 H), where that is more than they state.
JudgedBlocks judge(const std::vector<QuadraticBlock>& blocks, const Eigen::MatrixXd& stated,
                   const Eigen::MatrixXd& asked, const AdoptionOptions& options = {});

/// Numbers blocks in the order in which stamps meet them.
class Blocks {
 public:
  explicit Blocks(const AdoptionOptions& options = {}) : length_(options.block_s) {}
  int of(Timestamp stamp);
  int count() const { return static_cast<int>(seen_.size()); }

 private:
  double length_;
  std::vector<std::int64_t> seen_;
};

/// 0.999 quantile of chi-squared of one: a residual costs no more, in sigmas squared.
inline constexpr double kTruncated = 10.83;

}  // namespace lamina
