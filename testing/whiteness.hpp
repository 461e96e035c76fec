// Are whitened residuals white? Mean zero, covariance the unit matrix, within chance.
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace lamina {

/// Sums of whitened residuals r of one size, drawn independently. Of n draws of unit normal noise
/// a mean has the standard error 1/sqrt(n), an entry of the covariance at most sqrt(2/n).
class Whiteness {
 public:
  void add(const Eigen::VectorXd& r) {
    if (count_ == 0) {
      sum_ = Eigen::VectorXd::Zero(r.size());
      squares_ = Eigen::MatrixXd::Zero(r.size(), r.size());
    }
    sum_ += r;
    squares_ += r * r.transpose();
    ++count_;
  }
  Eigen::VectorXd mean() const { return sum_ / count_; }
  Eigen::MatrixXd covariance() const { return squares_ / count_; }  ///< about zero
  /// Every entry of mean and covariance within so many standard errors; false for NaN.
  bool white(double standard_errors = 5) const {
    if (count_ == 0) return false;
    const auto unit = Eigen::MatrixXd::Identity(sum_.size(), sum_.size());
    return mean().cwiseAbs().maxCoeff() < standard_errors / std::sqrt(count_) &&
           (covariance() - unit).cwiseAbs().maxCoeff() < standard_errors * std::sqrt(2 / count_);
  }

 private:
  double count_ = 0;
  Eigen::VectorXd sum_;
  Eigen::MatrixXd squares_;
};

}  // namespace lamina
