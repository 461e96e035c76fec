// Random numbers that are the same on every machine and for any number of threads.
#pragma once

#include <cstdint>
#include <vector>

namespace lamina::sim {

/// Number `counter` of stream `stream` of `seed`: 64 well mixed bits ([Steele2014], splitmix64).
/// A pure function, so that a pixel's noise does not depend on who computes it or when.
std::uint64_t random_bits(std::uint64_t seed, std::uint64_t stream, std::uint64_t counter);

/// Natural logarithm from additions and multiplications alone: the same bits everywhere, which
/// std::log does not promise. For x > 0.
double portable_log(double x);

/// Inverse of the standard normal distribution function, relative error 1e-15 ([Wichura1988]).
/// For p in (0, 1).
double normal_quantile(double p);

/// A stream of random numbers. Copies are independent and repeat the same numbers.
class Random {
 public:
  Random(std::uint64_t seed, std::uint64_t stream) : seed_(seed), stream_(stream) {}
  std::uint64_t bits() { return random_bits(seed_, stream_, counter_++); }
  /// In (0, 1), never either end.
  double uniform();
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// Mean 0, sigma 1.
  double normal() { return normal_quantile(uniform()); }

 private:
  std::uint64_t seed_, stream_, counter_ = 0;
};

/// Standard normal numbers by the million: 16 random bits choose one of 65,536 equally likely
/// values, whose mean is 0 and variance 1 exactly (largest 4.3).
class NormalTable {
 public:
  NormalTable();
  float operator[](std::uint16_t index) const { return values_[index]; }
  /// Fills `out` with white noise; element i depends on seed, stream and i alone.
  void fill(std::uint64_t seed, std::uint64_t stream, std::vector<float>& out) const;

 private:
  std::vector<float> values_;
};

}  // namespace lamina::sim
