// Results that must be exact, and results at the ends of the ranges.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <limits>

#include "core/math/elementary.h"

namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kLeast = std::numeric_limits<double>::denorm_min();
constexpr double kMost = std::numeric_limits<double>::max();

std::uint64_t bits(double x) { return std::bit_cast<std::uint64_t>(x); }

/// Equality of bits: the sign of zero matters, and any NaN must be the positive quiet NaN.
#define EXPECT_BITS(value, expected) EXPECT_EQ(bits(value), bits(expected)) << #value " is " << (value)

TEST(Special, AllNansAreThePositiveQuietOne) {
  const double other = std::bit_cast<double>(std::uint64_t{0xfff8000000001234u});
  for (const double x : {kNan, -kNan, other}) {
    double s = 0, c = 0;
    kt_sincos(x, &s, &c);
    for (const double y : {s,
                           c,
                           kt_sin(x),
                           kt_cos(x),
                           kt_tan(x),
                           kt_atan(x),
                           kt_atan2(x, 1),
                           kt_atan2(1, x),
                           kt_asin(x),
                           kt_acos(x),
                           kt_exp(x),
                           kt_log(x),
                           kt_pow(x, 2),
                           kt_pow(2, x),
                           kt_floor(x),
                           kt_fmod(x, 1),
                           kt_fmod(1, x),
                           kt_hypot(x, 1),
                           kt_hypot(1, x),
                           kt_inverse_normal(x)}) {
      EXPECT_BITS(y, kNan);
    }
  }
  for (const double y :
       {kt_sin(kInf), kt_cos(-kInf), kt_tan(kInf), kt_asin(1.0000000000000002), kt_acos(-1.5), kt_log(-1),
        kt_log(-kInf), kt_pow(-8, 1.0 / 3), kt_fmod(1, 0), kt_fmod(kInf, 2), kt_inverse_normal(-0.1),
        kt_inverse_normal(1.1), kt_inverse_normal(kInf), kt_inverse_normal(-kInf)}) {
    EXPECT_BITS(y, kNan);
  }
}

TEST(Special, ZerosKeepTheirSign) {
  for (const auto f : {kt_sin, kt_tan, kt_atan, kt_asin, kt_floor}) {
    EXPECT_BITS(f(0.0), 0.0);
    EXPECT_BITS(f(-0.0), -0.0);
  }
  EXPECT_BITS(kt_log(1), 0.0);
  EXPECT_BITS(kt_acos(1), 0.0);
  EXPECT_BITS(kt_fmod(-6, 3), -0.0);
  EXPECT_BITS(kt_fmod(6, -3), 0.0);
  EXPECT_BITS(kt_inverse_normal(0.5), 0.0);
}

TEST(Special, Circle) {
  EXPECT_EQ(kt_cos(0.0), 1);
  EXPECT_EQ(kt_sin(M_PI / 2), 1);
  EXPECT_EQ(kt_cos(M_PI), -1);
  EXPECT_EQ(kt_sin(kLeast), kLeast);
  EXPECT_EQ(kt_tan(-kLeast), -kLeast);
  EXPECT_EQ(kt_asin(1), M_PI / 2);
  EXPECT_EQ(kt_asin(-1), -M_PI / 2);
  EXPECT_EQ(kt_acos(-1), M_PI);
  EXPECT_EQ(kt_acos(0), M_PI / 2);
  EXPECT_EQ(kt_atan(1), M_PI / 4);
  EXPECT_EQ(kt_atan(kInf), M_PI / 2);
  EXPECT_EQ(kt_atan(-kInf), -M_PI / 2);
}

TEST(Special, SincosAgreesWithSineAndCosine) {
  for (double x = -40; x < 40; x += 0.0371) {
    double s = 0, c = 0;
    kt_sincos(x, &s, &c);
    EXPECT_BITS(kt_sin(x), s);
    EXPECT_BITS(kt_cos(x), c);
    EXPECT_BITS(kt_sin(-x), -s);
    EXPECT_BITS(kt_cos(-x), c);
    EXPECT_NEAR(s * s + c * c, 1, 4e-16);
  }
}

TEST(Special, AngleOfAPointAgreesWithTheStandard) {
  // IEEE 754 fixes these results, so libm is a reference for every bit, except for the rounding of multiples of pi/4.
  const double values[] = {0.0, -0.0, 1, -1, 3, -3, kInf, -kInf, kLeast, -kLeast, kMost, -kMost};
  for (const double y : values) {
    for (const double x : values) {
      const double expected = std::atan2(y, x);
      EXPECT_NEAR(kt_atan2(y, x), expected, 1e-16 * std::fabs(expected)) << y << ", " << x;
      EXPECT_EQ(std::signbit(kt_atan2(y, x)), std::signbit(expected)) << y << ", " << x;
    }
  }
}

TEST(Special, ExponentialAndLogarithm) {
  EXPECT_EQ(kt_exp(0.0), 1);
  EXPECT_EQ(kt_exp(-0.0), 1);
  EXPECT_EQ(kt_exp(kInf), kInf);
  EXPECT_BITS(kt_exp(-kInf), 0.0);
  EXPECT_EQ(kt_exp(0x1.62e42fefa39efp+9), 0x1.fffffffffff2ap+1023);
  EXPECT_EQ(kt_exp(0x1.62e42fefa39fp+9), kInf);
  EXPECT_EQ(kt_exp(-0x1.74910d52d3051p+9), kLeast);
  EXPECT_BITS(kt_exp(-745.2), 0.0);
  EXPECT_EQ(kt_log(0.0), -kInf);
  EXPECT_EQ(kt_log(-0.0), -kInf);
  EXPECT_EQ(kt_log(kInf), kInf);
  EXPECT_EQ(kt_log(kMost), 0x1.62e42fefa39efp+9);
  EXPECT_EQ(kt_log(2), 0x1.62e42fefa39efp-1);
}

TEST(Special, PowerAgreesWithTheStandard) {
  const double values[] = {0.0,   -0.0,   0.5,    -0.5,    1,      -1,      2,
                           -2,    3,      -3,     2.5,     -2.5,   kInf,    -kInf,
                           1e300, -1e300, kLeast, -kLeast, 0x1p53, -0x1p53, 9007199254740991.0};
  for (const double x : values) {
    for (const double y : values) {
      const double expected = std::pow(x, y);
      if (std::isnan(expected)) {
        EXPECT_BITS(kt_pow(x, y), kNan);
      } else {
        EXPECT_BITS(kt_pow(x, y), expected) << " of " << x << ", " << y;
      }
    }
  }
  EXPECT_EQ(kt_pow(1, kNan), 1);
  EXPECT_EQ(kt_pow(kNan, 0), 1);
  for (int i = 0; i <= 22; ++i) EXPECT_EQ(kt_pow(10, i), std::pow(10.0L, i)) << i;
  for (int i = -1074; i < 1024; ++i) EXPECT_EQ(kt_pow(2, i), std::ldexp(1.0, i)) << i;
}

TEST(Special, FloorRemainderHypotenuse) {
  EXPECT_EQ(kt_floor(-0.5), -1);
  EXPECT_BITS(kt_floor(0.5), 0.0);
  EXPECT_EQ(kt_floor(4503599627370495.5), 4503599627370495.0);
  EXPECT_EQ(kt_floor(-4503599627370495.5), -4503599627370496.0);
  EXPECT_EQ(kt_floor(kInf), kInf);
  EXPECT_EQ(kt_fmod(5, kInf), 5);
  EXPECT_EQ(kt_fmod(-5.5, 2), -1.5);
  EXPECT_EQ(kt_fmod(kMost, kLeast), 0);
  EXPECT_EQ(kt_fmod(3 * kLeast, 2 * kLeast), kLeast);
  EXPECT_EQ(kt_hypot(3, -4), 5);
  EXPECT_EQ(kt_hypot(0.0, -0.0), 0);
  EXPECT_EQ(kt_hypot(-kInf, kNan), kInf);
  EXPECT_EQ(kt_hypot(kLeast, 0), kLeast);
  EXPECT_EQ(kt_hypot(kMost, kMost), kInf);
  EXPECT_EQ(kt_hypot(3e300, 4e300), 5e300);
}

TEST(Special, InverseNormal) {
  EXPECT_EQ(kt_inverse_normal(0), -kInf);
  EXPECT_EQ(kt_inverse_normal(1), kInf);
  EXPECT_NEAR(kt_inverse_normal(0.975), 1.9599639845400542, 1e-15);
  EXPECT_NEAR(kt_inverse_normal(0x1p-53), -8.2095361516013856, 8e-15);
  for (double q = 0x1p-20; q < 0.5; q *= 1.1) {
    const double upper = 0.5 + q;
    EXPECT_BITS(kt_inverse_normal(upper), -kt_inverse_normal(1 - upper));
  }
}

}  // namespace
