// Random numbers: splitmix64 as a counter-based generator, and the normal quantile.
#include <lamina/sim/random.hpp>

#include <array>
#include <cmath>

namespace lamina::sim {
namespace {

constexpr std::uint64_t kGolden = 0x9E3779B97F4A7C15ULL;

std::uint64_t mix(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
  return z ^ (z >> 31);
}

std::uint64_t stream_key(std::uint64_t seed, std::uint64_t stream) {
  return mix(mix(seed + kGolden) ^ (stream * 0xD1342543DE82EF95ULL + kGolden));
}

double polynomial(const std::array<double, 8>& c, double x) {
  double sum = 0;
  for (std::size_t i = c.size(); i-- > 0;) {
    sum = sum * x + c[i];
  }
  return sum;
}

// Coefficients of the three rational functions of [Wichura1988], lowest order first.
constexpr std::array<double, 8> kMiddleUp = {3.3871328727963666080e0,  1.3314166789178437745e+2,
                                             1.9715909503065514427e+3, 1.3731693765509461125e+4,
                                             4.5921953931549871457e+4, 6.7265770927008700853e+4,
                                             3.3430575583588128105e+4, 2.5090809287301226727e+3};
constexpr std::array<double, 8> kMiddleDown = {1.0,
                                               4.2313330701600911252e+1,
                                               6.8718700749205790830e+2,
                                               5.3941960214247511077e+3,
                                               2.1213794301586595867e+4,
                                               3.9307895800092710610e+4,
                                               2.8729085735721942674e+4,
                                               5.2264952788528545610e+3};
constexpr std::array<double, 8> kTailUp = {1.42343711074968357734e0,  4.63033784615654529590e0,
                                           5.76949722146069140550e0,  3.64784832476320460504e0,
                                           1.27045825245236838258e0,  2.41780725177450611770e-1,
                                           2.27238449892691845833e-2, 7.74545014278341407640e-4};
constexpr std::array<double, 8> kTailDown = {1.0,
                                             2.05319162663775882187e0,
                                             1.67638483018380384940e0,
                                             6.89767334985100004550e-1,
                                             1.48103976427480074590e-1,
                                             1.51986665636164571966e-2,
                                             5.47593808499534494600e-4,
                                             1.05075007164441684324e-9};
constexpr std::array<double, 8> kFarUp = {6.65790464350110377720e0,  5.46378491116411436990e0,
                                          1.78482653991729133580e0,  2.96560571828504891230e-1,
                                          2.65321895265761230930e-2, 1.24266094738807843860e-3,
                                          2.71155556874348757815e-5, 2.01033439929228813265e-7};
constexpr std::array<double, 8> kFarDown = {1.0,
                                            5.99832206555887937690e-1,
                                            1.36929880922735805310e-1,
                                            1.48753612908506148525e-2,
                                            7.86869131145613259100e-4,
                                            1.84631831751005468180e-5,
                                            1.42151175831644588870e-7,
                                            2.04426310338993978564e-15};

}  // namespace

std::uint64_t random_bits(std::uint64_t seed, std::uint64_t stream, std::uint64_t counter) {
  return mix(stream_key(seed, stream) + counter * kGolden);
}

double portable_log(double x) {
  constexpr double kLn2 = 0.693147180559945309417;
  int exponent = 0;
  double m = std::frexp(x, &exponent);  // in [0.5, 1)
  if (m < 0.70710678118654752) {
    m *= 2;
    --exponent;
  }
  const double s = (m - 1) / (m + 1), s2 = s * s;
  double sum = 0;
  for (int k = 25; k >= 1; k -= 2) {
    sum = sum * s2 + 1.0 / k;
  }
  return 2 * s * sum + exponent * kLn2;
}

double normal_quantile(double p) {
  const double q = p - 0.5;
  if (std::abs(q) <= 0.425) {
    const double r = 0.180625 - q * q;
    return q * polynomial(kMiddleUp, r) / polynomial(kMiddleDown, r);
  }
  const double r = std::sqrt(-portable_log(q < 0 ? p : 1 - p));
  const double x = r <= 5 ? polynomial(kTailUp, r - 1.6) / polynomial(kTailDown, r - 1.6)
                          : polynomial(kFarUp, r - 5) / polynomial(kFarDown, r - 5);
  return q < 0 ? -x : x;
}

double Random::uniform() { return (static_cast<double>(bits() >> 11) + 0.5) * 0x1.0p-53; }

NormalTable::NormalTable() : values_(65536) {
  double square = 0;
  for (std::size_t i = 0; i < 32768; ++i) {
    const double x = normal_quantile((static_cast<double>(i) + 0.5) / 65536);
    square += 2 * x * x / 65536;
    values_[i] = static_cast<float>(x);
  }
  const float scale = static_cast<float>(1 / std::sqrt(square));
  for (std::size_t i = 0; i < 32768; ++i) {
    values_[i] *= scale;
    values_[65535 - i] = -values_[i];
  }
}

void NormalTable::fill(std::uint64_t seed, std::uint64_t stream, std::vector<float>& out) const {
  const std::uint64_t key = stream_key(seed, stream);
  const std::size_t n = out.size();
  for (std::size_t i = 0; i < n; i += 4) {
    std::uint64_t bits = mix(key + (i / 4) * kGolden);
    const std::size_t end = std::min(n, i + 4);
    for (std::size_t k = i; k < end; ++k, bits >>= 16) {
      out[k] = values_[bits & 0xFFFF];
    }
  }
}

}  // namespace lamina::sim
