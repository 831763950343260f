// Errors against the long double libm, whose own error is about 2^-11 of a double's unit in the last place.
// Set KILOTWIN_SHOW=1 to print the largest error found for each range.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <limits>
#include <random>
#include <string>

#include "core/math/elementary.h"

namespace {

constexpr int kSamples = 200000;
constexpr double kMax = std::numeric_limits<double>::max();
constexpr double kMin = std::numeric_limits<double>::min();
constexpr double kSmallest = std::numeric_limits<double>::denorm_min();

/// Distance of `value` from `exact` in units in the last place of the double nearest to `exact`.
double error_ulp(double value, long double exact) {
  const auto rounded = static_cast<double>(exact);
  if (std::isnan(value) || std::isnan(rounded)) return std::isnan(value) == std::isnan(rounded) ? 0 : 1e300;
  if (std::isinf(value) || std::isinf(rounded)) return value == rounded ? 0 : 1e300;
  int exponent = 0;
  std::frexp(rounded == 0 ? kSmallest : rounded, &exponent);
  const long double ulp = std::ldexp(1.0L, std::max(exponent - 53, -1074));
  return static_cast<double>(std::fabs(static_cast<long double>(value) - exact) / ulp);
}

/// Arguments in one range: `uniform` in value, or `spread` evenly over exponents (both limits of one sign).
class Range {
 public:
  static Range uniform(double low, double high) { return Range(low, high, false); }
  static Range spread(double low, double high) { return Range(low, high, true); }
  double operator()(std::mt19937_64& random) const {
    const double u = static_cast<double>(random() >> 11) * 0x1p-53;
    if (!spread_) return low_ + u * (high_ - low_);
    const double from = std::log2(std::fabs(low_)), to = std::log2(std::fabs(high_));
    return std::copysign(std::fmin(std::fmax(std::exp2(from + u * (to - from)), kSmallest), kMax), low_);
  }

 private:
  Range(double low, double high, bool spread) : low_(low), high_(high), spread_(spread) {}
  double low_, high_;
  bool spread_;
};

using One = std::function<double(double)>;
using OneExact = std::function<long double(long double)>;

void expect_within(double limit_ulp, const std::string& name, const Range& range, const One& f,
                   const OneExact& exact) {
  std::mt19937_64 random(20180901);
  double worst = 0, worst_at = 0;
  for (int i = 0; i < kSamples; ++i) {
    const double x = range(random);
    const double error = error_ulp(f(x), exact(static_cast<long double>(x)));
    if (error > worst) worst = error, worst_at = x;
  }
  if (std::getenv("KILOTWIN_SHOW") != nullptr) std::printf("%-28s %.4f ulp at %a\n", name.c_str(), worst, worst_at);
  EXPECT_LE(worst, limit_ulp) << name << " at " << worst_at;
}

using Two = std::function<double(double, double)>;
using TwoExact = std::function<long double(long double, long double)>;

void expect_within(double limit_ulp, const std::string& name, const Range& first, const Range& second, const Two& f,
                   const TwoExact& exact) {
  std::mt19937_64 random(20180902);
  double worst = 0, worst_x = 0, worst_y = 0;
  for (int i = 0; i < kSamples; ++i) {
    const double x = (random() & 1) != 0 ? first(random) : -first(random), y = second(random);
    const double error = error_ulp(f(x, y), exact(static_cast<long double>(x), static_cast<long double>(y)));
    if (error > worst) worst = error, worst_x = x, worst_y = y;
  }
  if (std::getenv("KILOTWIN_SHOW") != nullptr) {
    std::printf("%-28s %.4f ulp at %a, %a\n", name.c_str(), worst, worst_x, worst_y);
  }
  EXPECT_LE(worst, limit_ulp) << name << " at " << worst_x << ", " << worst_y;
}

long double sine(long double x) { return std::sin(x); }
long double cosine(long double x) { return std::cos(x); }
long double tangent(long double x) { return std::tan(x); }

TEST(Accuracy, SineAndCosine) {
  for (const auto& range : {Range::uniform(-7, 7), Range::uniform(-1e6, 1e6), Range::spread(1e6, kMax),
                            Range::spread(-1e-300, -1e6), Range::spread(kSmallest, 1)}) {
    expect_within(0.85, "sin", range, kt_sin, sine);
    expect_within(0.85, "cos", range, kt_cos, cosine);
  }
}

TEST(Accuracy, Tangent) {
  for (const auto& range :
       {Range::uniform(-7, 7), Range::uniform(-1e6, 1e6), Range::spread(1e6, kMax), Range::spread(1e-300, 1e6)}) {
    expect_within(1.0, "tan", range, kt_tan, tangent);
  }
}

TEST(Accuracy, NextToMultiplesOfAQuarterTurn) {
  double worst = 0;
  const auto check = [&worst](double x) {
    const auto exact = static_cast<long double>(x);
    worst = std::fmax(worst, error_ulp(kt_sin(x), std::sin(exact)));
    worst = std::fmax(worst, error_ulp(kt_cos(x), std::cos(exact)));
    worst = std::fmax(worst, error_ulp(kt_tan(x), std::tan(exact)));
  };
  for (int k = 1; k < 700000; k += k < 100000 ? 1 : 7) {
    const auto x = static_cast<double>(static_cast<long double>(k) * 1.5707963267948966192313216916L);
    check(x);
    check(-std::nextafter(x, 0.0));
    check(std::nextafter(x, 1e9));
  }
  // The double nearest to a multiple of pi/2: the remainder is 2^-60 of it.
  check(0x1.6ac5b262ca1ffp+849);
  EXPECT_LE(worst, 1.0);
  EXPECT_EQ(kt_cos(0x1.6ac5b262ca1ffp+849), -4.6871659242546277e-19);
}

TEST(Accuracy, ArcFunctions) {
  const auto atan = [](long double x) { return std::atan(x); };
  for (const auto& range : {Range::uniform(-2, 2), Range::spread(1e-310, kMax), Range::uniform(-0.07, 0.07)}) {
    expect_within(1.0, "atan", range, kt_atan, atan);
  }
  const auto asin = [](long double x) { return std::asin(x); };
  const auto acos = [](long double x) { return std::acos(x); };
  for (const auto& range : {Range::uniform(-1, 1), Range::spread(1e-310, 1), Range::uniform(0.999999, 1)}) {
    expect_within(1.0, "asin", range, kt_asin, asin);
    expect_within(1.0, "acos", range, kt_acos, acos);
  }
  const auto atan2 = [](long double y, long double x) { return std::atan2(y, x); };
  expect_within(1.0, "atan2", Range::uniform(-1000, 1000), Range::uniform(-1000, 1000), kt_atan2, atan2);
  expect_within(1.0, "atan2 anywhere", Range::spread(kSmallest, kMax), Range::spread(kSmallest, kMax), kt_atan2,
                atan2);
  expect_within(1.0, "atan2 left anywhere", Range::spread(kSmallest, kMax), Range::spread(-kSmallest, -kMax),
                kt_atan2, atan2);
  expect_within(1.0, "atan2 large", Range::spread(1e290, kMax), Range::spread(1e290, kMax), kt_atan2, atan2);
  expect_within(1.0, "atan2 subnormal", Range::spread(kSmallest, 1e-300), Range::spread(kSmallest, 1e-300),
                kt_atan2, atan2);
}

TEST(Accuracy, ExponentialAndLogarithm) {
  const auto exp = [](long double x) { return std::exp(x); };
  const auto log = [](long double x) { return std::log(x); };
  expect_within(0.6, "exp", Range::uniform(-708, 709.7), kt_exp, exp);
  expect_within(0.6, "exp near 0", Range::uniform(-1, 1), kt_exp, exp);
  expect_within(0.6, "exp tiny", Range::spread(1e-300, 1), kt_exp, exp);
  expect_within(1.0, "exp subnormal", Range::uniform(-745.2, -708), kt_exp, exp);
  expect_within(0.6, "log", Range::spread(kMin, kMax), kt_log, log);
  expect_within(0.6, "log subnormal", Range::spread(kSmallest, kMin), kt_log, log);
  expect_within(0.6, "log near 1", Range::uniform(0.9, 1.1), kt_log, log);
  expect_within(0.6, "log at 1", Range::uniform(1 - 1e-12, 1 + 1e-12), kt_log, log);
}

TEST(Accuracy, Power) {
  const auto pow = [](long double x, long double y) { return std::pow(x, y); };
  const auto of_size = [](double x, double y) { return kt_pow(std::fabs(x), y); };
  const auto of_size_exact = [&pow](long double x, long double y) { return pow(std::fabs(x), y); };
  expect_within(0.7, "pow", Range::uniform(0, 100), Range::uniform(-150, 150), of_size, of_size_exact);
  expect_within(0.7, "pow near 1", Range::uniform(0.99, 1.01), Range::uniform(-60000, 60000), of_size,
                of_size_exact);
  expect_within(1.1, "pow anywhere", Range::spread(kSmallest, kMax), Range::spread(1e-20, 1e3), of_size,
                of_size_exact);
  const auto square = [](double x) { return kt_pow(x, 2); };
  expect_within(0.6, "square", Range::uniform(-1e10, 1e10), square, [](long double x) { return x * x; });
}

TEST(Accuracy, Hypotenuse) {
  const auto hypot = [](long double x, long double y) { return std::hypot(x, y); };
  expect_within(1.25, "hypot", Range::uniform(-1000, 1000), Range::uniform(-1000, 1000), kt_hypot, hypot);
  expect_within(1.25, "hypot anywhere", Range::spread(kSmallest, kMax), Range::spread(kSmallest, kMax), kt_hypot,
                hypot);
}

TEST(Accuracy, FloorAndRemainderAreExact) {
  std::mt19937_64 random(5);
  const Range anywhere = Range::spread(kSmallest, kMax), usual = Range::uniform(-1e6, 1e6);
  for (int i = 0; i < kSamples; ++i) {
    const double x = usual(random), y = usual(random), large = anywhere(random), other = -anywhere(random);
    ASSERT_EQ(kt_floor(x), std::floor(x)) << x;
    ASSERT_EQ(kt_floor(large), std::floor(large)) << large;
    ASSERT_EQ(kt_floor(other), std::floor(other)) << other;
    ASSERT_EQ(kt_fmod(x, y), std::fmod(x, y)) << x << ", " << y;
    if (i % 20 == 0) {
      ASSERT_EQ(kt_fmod(large, other), std::fmod(large, other)) << large << ", " << other;
      ASSERT_EQ(kt_fmod(other, large), std::fmod(other, large)) << other << ", " << large;
    }
  }
}

/// The quantile by Newton's method on the logarithm of the tail probability (tail <= 1/2), from a close start.
long double tail_quantile(long double tail, long double start) {
  long double x = start;
  for (int i = 0; i < 4; ++i) {
    const long double q = std::erfc(x / std::sqrt(2.0L)) / 2;
    const long double density = std::exp(-x * x / 2) / 2.506628274631000502415765284811L;
    x += std::log(q / tail) * q / density;
  }
  return x;
}

TEST(Accuracy, InverseNormal) {
  const auto worst_relative = [](const Range& range, bool upper_half, const char* name) {
    std::mt19937_64 random(77);
    double worst = 0, worst_ulp = 0;
    for (int i = 0; i < kSamples / 4; ++i) {
      const double tail = range(random);
      const double p = upper_half ? 1 - tail : tail;  // Exact: `tail` is drawn on the grid of 2^-53 there.
      const double value = kt_inverse_normal(p);
      const long double exact =
          upper_half ? tail_quantile(1 - static_cast<long double>(p), static_cast<long double>(value))
                     : -tail_quantile(static_cast<long double>(p), -static_cast<long double>(value));
      worst = std::fmax(worst, std::fabs(static_cast<double>((static_cast<long double>(value) - exact) / exact)));
      worst_ulp = std::fmax(worst_ulp, error_ulp(value, exact));
    }
    if (std::getenv("KILOTWIN_SHOW") != nullptr) {
      std::printf("inverse_normal %-13s relative %.3g, %.3f ulp\n", name, worst, worst_ulp);
    }
    return worst;
  };
  EXPECT_LE(worst_relative(Range::uniform(1e-9, 0.49), false, "lower"), 1e-15);
  EXPECT_LE(worst_relative(Range::uniform(1e-9, 0.49), true, "upper"), 1e-15);
  EXPECT_LE(worst_relative(Range::spread(1e-16, 0.1), false, "tail"), 1e-15);
  EXPECT_LE(worst_relative(Range::spread(kMin, 1e-9), false, "far tail"), 1e-15);
  // Near the median the quantile is sqrt(2 pi) q (1 + pi q^2 / 3 + 7 pi^2 q^4 / 30 + ...).
  std::mt19937_64 random(78);
  for (int i = 0; i < 10000; ++i) {
    const double q =
        static_cast<double>(static_cast<std::int64_t>(random() >> 11) - (std::int64_t{1} << 52)) * 0x1p-62;
    const auto exact_q = static_cast<long double>((0.5 + q) - 0.5);
    const long double pi = 3.14159265358979323846264338L, square = pi * exact_q * exact_q;
    const long double exact = std::sqrt(2 * pi) * exact_q * (1 + square / 3 + 7 * square * square / 30);
    const double value = kt_inverse_normal(0.5 + q);
    ASSERT_LE(std::fabs(static_cast<long double>(value) - exact), 1e-15L * std::fabs(exact)) << q;
  }
}

TEST(Accuracy, InverseNormalGrows) {
  // If the quantile decreased where two approximations meet, the order of draws could differ from that of probabilities.
  for (const double seam : {0.078125, 0.921875, 1.6052280551856116e-09, 0.5}) {
    double x = seam;
    for (int i = 0; i < 2000; ++i) x = std::nextafter(x, 0.0);
    double before = kt_inverse_normal(x);
    for (int i = 0; i < 4000; i += 40) {
      for (int k = 0; k < 40; ++k) x = std::nextafter(x, 1.0);
      const double now = kt_inverse_normal(x);
      ASSERT_GE(now, before - 4e-15 * std::fabs(before)) << x;
      before = now;
    }
  }
}

}  // namespace
