// Linear evidence of a few parameters, kept by blocks of time so that each can be left out.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include <lamina/models/adoption.hpp>

namespace lamina {

/// Facts value = row . p + noise, robustly solved for p with a prior about zero, the stated value.
/// The noise is what the facts show: their stated sigmas are relative to each other.
template <int N>
class BlockEvidence {
 public:
  using Vector = Eigen::Matrix<double, N, 1>;
  using Matrix = Eigen::Matrix<double, N, N>;
  struct Found {
    Vector value = Vector::Zero();
    Matrix covariance = Matrix::Zero();  ///< by leaving out block after block
    Adoption adoption;
  };

  void add(Timestamp stamp, const Vector& row, double value, double sigma) {
    facts_.push_back({blocks_.of(stamp), row / sigma, value / sigma});
  }
  std::size_t size() const { return facts_.size(); }
  int blocks() const { return blocks_.count(); }

  /// `free`: parameters asked about, of prior sigmas `prior`; `beside`: those that are free under
  /// the stated values, too. Any other is held at zero. nullopt for fewer than two blocks.
  /// Adopted: the test of AdoptionOptions, and off zero by Student's t of the blocks in one of the
  /// parameters asked about. `start`: where the search begins; of few facts that tell of a large
  /// value the others would make outliers.
  std::optional<Found> solve(const Vector& prior, const std::vector<int>& free,
                             const std::vector<int>& beside = {},
                             const Vector& start = Vector::Zero()) const {
    const int count = blocks_.count();
    if (count < 2) return std::nullopt;
    const Vector stated_prior = held(prior, beside, {}), found_prior = held(prior, free, beside);
    Found found;
    found.value = start;
    double noise = spread(found.value);
    for (int round = 0; round < kSpreads; ++round) {
      found.value = fit(found_prior, -1, noise, found.value);
      noise = spread(found.value);
    }
    std::vector<Eigen::VectorXd> left_out;
    std::vector<double> gains;
    for (int k = 0; k < count; ++k) {
      const Vector without = fit(found_prior, k, noise, found.value);
      const Vector stated = fit(stated_prior, k, noise, Vector::Zero());
      left_out.emplace_back(without);
      gains.push_back(cost(stated, k, noise) - cost(without, k, noise));
    }
    found.covariance = jackknife_covariance(left_out);
    found.adoption = judge(gains);
    const double least = student_quantile(count - 1.0);
    found.adoption.adopted =
        found.adoption.adopted && std::any_of(free.begin(), free.end(), [&](int i) {
          return std::abs(found.value(i)) > least * std::sqrt(found.covariance(i, i));
        });
    return found;
  }

 private:
  static constexpr int kSpreads = 10;  // the first is of what p = 0 leaves, however far off that is
  struct Fact {
    int block;
    Vector row;  // in the fact's sigmas
    double value;
  };

  static Vector held(const Vector& prior, const std::vector<int>& a, const std::vector<int>& b) {
    constexpr double kHeld = 1e9;  // of information, in a fact's
    Vector information = Vector::Constant(kHeld / prior.cwiseAbs2().minCoeff());
    for (const int i : a) information(i) = 1 / (prior(i) * prior(i));
    for (const int i : b) information(i) = 1 / (prior(i) * prior(i));
    return information;
  }

  // Geman and McClure's weights at three of the noise's sigmas: what is far off has no say at all,
  // as many slips to one side would have by Cauchy's.
  Vector fit(const Vector& information, int without, double noise, Vector p) const {
    constexpr int kRounds = 8;
    for (int round = 0; round < kRounds; ++round) {
      Matrix H = information.asDiagonal();
      Vector b = Vector::Zero();
      for (const Fact& fact : facts_) {
        if (fact.block == without) continue;
        const double r = (fact.value - fact.row.dot(p)) / noise;
        const double near = 1 / (1 + r * r / 9), weight = near * near / (noise * noise);
        H += weight * fact.row * fact.row.transpose();
        b += weight * fact.value * fact.row;
      }
      const Vector next = H.ldlt().solve(b);
      const double step = (next - p).norm();
      p = next;
      if (step < 1e-9 * (1 + p.norm())) break;
    }
    return p;
  }

  double cost(const Vector& p, int block, double noise) const {
    double sum = 0;
    for (const Fact& fact : facts_) {
      if (fact.block != block) continue;
      const double r = (fact.value - fact.row.dot(p)) / noise;
      sum += std::min(r * r, kTruncated);
    }
    return sum;
  }

  // One sigma of the facts' misfits, by their median.
  double spread(const Vector& p) const {
    constexpr double kMedian = 0.6745, kLeast = 1e-6;  // of |normal| of variance 1
    std::vector<double> sizes;
    for (const Fact& fact : facts_) sizes.push_back(std::abs(fact.value - fact.row.dot(p)));
    const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
    std::nth_element(sizes.begin(), middle, sizes.end());
    return std::max(kLeast, *middle / kMedian);
  }

  Blocks blocks_;
  std::vector<Fact> facts_;
};

}  // namespace lamina
