// What every Lie group must satisfy, over the identity, 1e-10, 1e-5, random, pi - 1e-6 and pi.
#pragma once

#include <gmock/gmock.h>

#include <cmath>
#include <string>
#include <vector>

#include "support/matchers.hpp"
#include "support/random.hpp"

namespace lamina::test {

/// SO3 or SE3 as the tester sees it: Tangent, its size, where the rotation sits in it, its action.
template <typename Group>
struct LieTraits;

template <>
struct LieTraits<SO3> {
  static constexpr int kSize = 3;
  using Tangent = Eigen::Vector3d;
  static Tangent tangent(const Eigen::Vector3d&, const Eigen::Vector3d& w) { return w; }
  static Eigen::Vector3d rotation_of(const Tangent& d) { return d; }
  static Eigen::Matrix3d matrix(const SO3& g) { return g.matrix(); }
};

template <>
struct LieTraits<SE3> {
  static constexpr int kSize = 6;
  using Tangent = Vector6d;
  static Tangent tangent(const Eigen::Vector3d& v, const Eigen::Vector3d& w) {
    return (Tangent() << v, w).finished();
  }
  static Eigen::Vector3d rotation_of(const Tangent& d) { return d.tail<3>(); }
  static Eigen::Matrix4d matrix(const SE3& g) { return g.matrix(); }
};

struct NamedAngle {
  double angle;
  const char* name;
};
inline const std::vector<NamedAngle>& lie_angles() {
  static const std::vector<NamedAngle> kAngles{{0, "identity"},
                                               {1e-10, "1e-10"},
                                               {1e-5, "1e-5"},
                                               {1e-3, "1e-3"},
                                               {0.05, "0.05"},
                                               {-1, "random"},
                                               {M_PI - 1e-3, "pi - 1e-3"},
                                               {M_PI - 1e-6, "pi - 1e-6"},
                                               {M_PI, "pi"}};
  return kAngles;
}

/// Calls visit(tangent, name) for tangents of each of those angles, about the axes and about random
/// ones, with translations of different sizes.
template <typename Group, typename Visit>
void for_each_tangent(Visit visit) {
  Random random(20);
  for (const auto& [angle, name] : lie_angles()) {
    for (int i = 0; i < 12; ++i) {
      Eigen::Vector3d axis = random.unit_vector();
      if (i < 6) axis = (i % 2 ? -1.0 : 1.0) * Eigen::Vector3d::Unit(i / 2);
      const double turn = angle < 0 ? random.uniform(0.1, 3.0) : angle;
      const double reach = i % 3 == 0 ? 0.0 : (i % 3 == 1 ? 1e-6 : 3.0);
      visit(LieTraits<Group>::tangent(reach * random.normal3(), turn * axis), std::string(name));
    }
  }
}

/// The derivative at zero of a function of a small tangent to a tangent, by central differences
/// with one Richardson step: good to 1e-9.
template <int kSize, typename Function>
Eigen::Matrix<double, kSize, kSize> numeric_jacobian(Function f) {
  Eigen::Matrix<double, kSize, kSize> J;
  const auto slope = [&f](int k, double h) {
    Eigen::Matrix<double, kSize, 1> d = Eigen::Matrix<double, kSize, 1>::Zero();
    d(k) = h;
    const Eigen::Matrix<double, kSize, 1> up = f(d);
    d(k) = -h;
    return Eigen::Matrix<double, kSize, 1>((up - f(d)) / (2 * h));
  };
  for (int k = 0; k < kSize; ++k) {
    constexpr double kStep = 2e-3;
    J.col(k) = (4.0 * slope(k, kStep) - slope(k, 2 * kStep)) / 3.0;
  }
  return J;
}

template <typename Group>
class LieGroupTest : public testing::Test {};
TYPED_TEST_SUITE_P(LieGroupTest);

TYPED_TEST_P(LieGroupTest, ExpOfLogIsTheElement) {
  for_each_tangent<TypeParam>([](const auto& d, const std::string& name) {
    const TypeParam g = TypeParam::exp(d);
    EXPECT_THAT(TypeParam::exp(g.log()), IsNear(g, 2e-14 * (1 + d.norm()))) << name;
  });
}

TYPED_TEST_P(LieGroupTest, LogOfExpIsTheTangent) {
  for_each_tangent<TypeParam>([](const auto& d, const std::string& name) {
    auto back = TypeParam::exp(d).log();
    // At pi itself both rotation vectors are right; compare what they stand for.
    if (name == "pi" &&
        LieTraits<TypeParam>::rotation_of(back).dot(LieTraits<TypeParam>::rotation_of(d)) < 0) {
      EXPECT_THAT(LieTraits<TypeParam>::matrix(TypeParam::exp(back)),
                  IsNear(LieTraits<TypeParam>::matrix(TypeParam::exp(d)), 1e-14))
          << name;
      return;
    }
    EXPECT_THAT(Eigen::MatrixXd(back), IsNear(Eigen::MatrixXd(d), 2e-14 * (1 + d.norm()))) << name;
  });
}

// Relative accuracy: a tangent of 1e-10 comes back to 1e-24, not to 1e-16.
TYPED_TEST_P(LieGroupTest, SmallTangentsKeepTheirDigits) {
  Random random(21);
  for (const double size : {1e-3, 1e-5, 1e-8, 1e-10, 1e-30, 1e-160}) {
    const auto d =
        LieTraits<TypeParam>::tangent(size * random.unit_vector(), size * random.unit_vector());
    const Eigen::MatrixXd back = TypeParam::exp(d).log();
    EXPECT_THAT(Eigen::MatrixXd(back / size), IsNear(Eigen::MatrixXd(d / size), 1e-14)) << size;
  }
}

TYPED_TEST_P(LieGroupTest, ExpIsTheMatrixExponential) {
  for_each_tangent<TypeParam>([](const auto& d, const std::string& name) {
    // Scaling and squaring: exp(D) = exp(D / 2^k)^(2^k).
    const Eigen::MatrixXd D = TypeParam::hat(d) / 1024.0;
    Eigen::MatrixXd power = Eigen::MatrixXd::Identity(D.rows(), D.cols()), sum = power;
    for (int k = 1; k < 12; ++k) sum += power = power * D / k;
    for (int k = 0; k < 10; ++k) sum = sum * sum;
    EXPECT_THAT(Eigen::MatrixXd(LieTraits<TypeParam>::matrix(TypeParam::exp(d))),
                IsNear(sum, 1e-12))
        << name;
  });
}

TYPED_TEST_P(LieGroupTest, HatAndVeeAreInverse) {
  for_each_tangent<TypeParam>([](const auto& d, const std::string& name) {
    EXPECT_EQ(TypeParam::vee(TypeParam::hat(d)), d) << name;
  });
}

TYPED_TEST_P(LieGroupTest, IsAGroup) {
  Random random(22);
  for_each_tangent<TypeParam>([&random](const auto& d, const std::string& name) {
    const auto other = [&random] {
      return TypeParam::exp(LieTraits<TypeParam>::tangent(random.normal3(), random.normal3()));
    };
    const TypeParam a = TypeParam::exp(d), b = other(), c = other();
    EXPECT_THAT((a * b) * c, IsNear(a * (b * c), 1e-13)) << name;
    EXPECT_THAT(a * a.inverse(), IsNear(TypeParam(), 1e-14)) << name;
    EXPECT_THAT(a.inverse() * a, IsNear(TypeParam(), 1e-14)) << name;
    EXPECT_THAT((a * b).inverse(), IsNear(b.inverse() * a.inverse(), 1e-13)) << name;
    const Eigen::Vector3d x = random.normal3();
    EXPECT_THAT(Eigen::MatrixXd((a * b) * x), IsNear(Eigen::MatrixXd(a * (b * x)), 1e-13)) << name;
    EXPECT_THAT(
        Eigen::MatrixXd(LieTraits<TypeParam>::matrix(a * b)),
        IsNear(Eigen::MatrixXd(LieTraits<TypeParam>::matrix(a) * LieTraits<TypeParam>::matrix(b)),
               1e-13))
        << name;
  });
}

TYPED_TEST_P(LieGroupTest, AdjointMovesTangentsThrough) {
  for_each_tangent<TypeParam>([](const auto& d, const std::string& name) {
    const TypeParam g = TypeParam::exp(d);
    const auto J = numeric_jacobian<LieTraits<TypeParam>::kSize>(
        [&g](const auto& e) { return (g * TypeParam::exp(e) * g.inverse()).log(); });
    EXPECT_THAT(Eigen::MatrixXd(g.adjoint()), IsNear(Eigen::MatrixXd(J), 1e-9)) << name;
  });
}

TYPED_TEST_P(LieGroupTest, JacobiansAreTheDerivativesOfExp) {
  for_each_tangent<TypeParam>([](const auto& d, const std::string& name) {
    const TypeParam g = TypeParam::exp(d);
    const auto right = numeric_jacobian<LieTraits<TypeParam>::kSize>(
        [&](const auto& e) { return (g.inverse() * TypeParam::exp(d + e)).log(); });
    EXPECT_THAT(Eigen::MatrixXd(TypeParam::right_jacobian(d)), IsNear(Eigen::MatrixXd(right), 2e-9))
        << name;
    const auto left = numeric_jacobian<LieTraits<TypeParam>::kSize>(
        [&](const auto& e) { return (TypeParam::exp(d + e) * g.inverse()).log(); });
    EXPECT_THAT(Eigen::MatrixXd(TypeParam::left_jacobian(d)), IsNear(Eigen::MatrixXd(left), 2e-9))
        << name;
  });
}

TYPED_TEST_P(LieGroupTest, InverseJacobiansAreInverse) {
  for_each_tangent<TypeParam>([](const auto& d, const std::string& name) {
    const auto unit = Eigen::MatrixXd::Identity(d.size(), d.size()).eval();
    const double tolerance = 1e-13 * (1 + d.norm()) * (1 + d.norm());
    EXPECT_THAT(Eigen::MatrixXd(TypeParam::left_jacobian(d) * TypeParam::left_jacobian_inverse(d)),
                IsNear(unit, tolerance))
        << name;
    EXPECT_THAT(
        Eigen::MatrixXd(TypeParam::right_jacobian_inverse(d) * TypeParam::right_jacobian(d)),
        IsNear(unit, tolerance))
        << name;
  });
}

// Jl(d) = Adj(exp d) Jr(d), an identity that ties all four functions together.
TYPED_TEST_P(LieGroupTest, LeftIsAdjointTimesRight) {
  for_each_tangent<TypeParam>([](const auto& d, const std::string& name) {
    const double tolerance = 1e-13 * (1 + d.norm()) * (1 + d.norm());
    EXPECT_THAT(Eigen::MatrixXd(TypeParam::exp(d).adjoint() * TypeParam::right_jacobian(d)),
                IsNear(Eigen::MatrixXd(TypeParam::left_jacobian(d)), tolerance))
        << name;
  });
}

REGISTER_TYPED_TEST_SUITE_P(LieGroupTest, ExpOfLogIsTheElement, LogOfExpIsTheTangent,
                            SmallTangentsKeepTheirDigits, ExpIsTheMatrixExponential,
                            HatAndVeeAreInverse, IsAGroup, AdjointMovesTangentsThrough,
                            JacobiansAreTheDerivativesOfExp, InverseJacobiansAreInverse,
                            LeftIsAdjointTimesRight);

}  // namespace lamina::test
