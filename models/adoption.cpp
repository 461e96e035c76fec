// Sums over blocks.
#include <lamina/models/adoption.hpp>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace lamina {

void BlockGains::add(double gain) {
  ++count_;
  sum_ += gain;
  squares_ += gain * gain;
}

Adoption BlockGains::judge(const AdoptionOptions& options) const {
  Adoption result{static_cast<int>(count_), sum_, 0, false};
  if (count_ < 2) return result;
  const double n = static_cast<double>(count_), mean = sum_ / n;
  const double variance = std::max(0.0, squares_ - n * mean * mean) / (n - 1);
  const double sigma = std::sqrt(variance / n);
  result.sigmas = sigma > 0 ? mean / sigma : 0;
  result.adopted = count_ >= options.least_blocks && sum_ > options.least_gain &&
                   mean > options.least_sigmas * sigma;
  return result;
}

Adoption judge(const std::vector<double>& gains, const AdoptionOptions& options) {
  BlockGains sums;
  for (const double gain : gains) sums.add(gain);
  return sums.judge(options);
}

double student_quantile(double dof) {
  constexpr double z = 3;
  const double n = std::max(dof, 1.0), z3 = z * z * z, z5 = z3 * z * z;
  return z + (z3 + z) / (4 * n) + (5 * z5 + 16 * z3 + 3 * z) / (96 * n * n);
}

Eigen::MatrixXd jackknife_covariance(const std::vector<Eigen::VectorXd>& left_out) {
  const auto size = left_out.empty() ? 0 : left_out.front().size();
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(size);
  const double n = static_cast<double>(left_out.size());
  for (const Eigen::VectorXd& one : left_out) mean += one / n;
  for (const Eigen::VectorXd& one : left_out) sum += (one - mean) * (one - mean).transpose();
  return (n - 1) / std::max(n, 1.0) * sum;
}

double jackknife_sigma(const std::vector<double>& left_out) {
  std::vector<Eigen::VectorXd> all;
  for (const double one : left_out) all.push_back(Eigen::VectorXd::Constant(1, one));
  return all.empty() ? 0 : std::sqrt(jackknife_covariance(all)(0, 0));
}

namespace {

QuadraticBlock sum(const std::vector<QuadraticBlock>& blocks) {
  QuadraticBlock all = blocks.front();
  for (std::size_t k = 1; k < blocks.size(); ++k) {
    all.H += blocks[k].H;
    all.b += blocks[k].b;
  }
  return all;
}

}  // namespace

JudgedBlocks judge(const std::vector<QuadraticBlock>& blocks, const Eigen::MatrixXd& stated,
                   const Eigen::MatrixXd& asked, const AdoptionOptions& options) {
  JudgedBlocks result;
  if (blocks.size() < 2) return result;
  const QuadraticBlock all = sum(blocks);
  const auto solve = [](const Eigen::MatrixXd& H, const Eigen::VectorXd& b) {
    return Eigen::VectorXd(H.ldlt().solve(b));
  };
  result.value = solve(all.H + asked, all.b);
  double excess = 0, observed = 0;
  std::vector<double> gains;
  std::vector<Eigen::VectorXd> left_out;
  for (const QuadraticBlock& block : blocks) {
    const Eigen::MatrixXd H = all.H - block.H;
    const Eigen::VectorXd b = all.b - block.b;
    const Eigen::VectorXd p = solve(H + asked, b), p0 = solve(H + stated, b);
    const auto cost = [&block](const Eigen::VectorXd& at) {
      return at.dot(block.H * at) - 2 * block.b.dot(at);
    };
    // How far the least of the block's own cost lies below what the others give it, and how many
    // parameters the block observes.
    const Eigen::VectorXd own = solve(block.H + asked, block.b);
    excess += cost(p) - cost(own);
    observed += Eigen::MatrixXd((block.H + asked).ldlt().solve(block.H)).trace();
    gains.push_back(cost(p0) - cost(p));
    left_out.push_back(p);
  }
  const double noise = observed > 0 ? std::max(1.0, excess / observed) : 1.0;
  for (double& gain : gains) gain /= noise;
  result.covariance = jackknife_covariance(left_out);
  result.adoption = judge(gains, options);
  const double least = student_quantile(static_cast<double>(blocks.size()) - 1);
  bool off = false;
  for (Eigen::Index k = 0; k < result.value.size(); ++k) {
    const bool of_asked = stated(k, k) > 2 * asked(k, k);
    off |= of_asked && std::abs(result.value(k)) > least * std::sqrt(result.covariance(k, k));
  }
  result.adoption.adopted = result.adoption.adopted && off;
  return result;
}

int Blocks::of(Timestamp stamp) {
  const auto number = static_cast<std::int64_t>(
      std::floor(static_cast<double>(stamp.nanoseconds()) / (1e9 * length_)));
  // Stamps mostly go on: the last block is the likeliest.
  const auto known = std::find(seen_.rbegin(), seen_.rend(), number);
  if (known != seen_.rend()) return static_cast<int>(seen_.rend() - known) - 1;
  seen_.push_back(number);
  return count() - 1;
}

}  // namespace lamina
