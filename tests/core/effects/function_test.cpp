// Functions of effects against their closed forms.
#include "core/effects/function.hpp"
#include "core/plan/from_manifest.hpp"
#include "idl/effects.pb.h"

#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace kilotwin {
namespace {

EffectFunction function(const std::string& text) {
  proto::Function parsed;
  if (!google::protobuf::TextFormat::ParseFromString(text, &parsed)) throw std::runtime_error(text);
  return EffectFunction(settings_of(parsed));
}

std::string list(const std::vector<double>& values) {
  std::string text = "[";
  for (const double v : values) text += (text.size() > 1 ? ", " : "") + std::to_string(v);
  return text + "]";
}

TEST(EffectFunction, SimpleShapesAreTheirFormulas) {
  const EffectFunction constant = function("constant: -0.25"),
                       linear = function("linear { at_zero: 2 slope: -0.5 }"),
                       decay = function("exponential { at_zero: 3 at_infinity: -1 scale: 40 }"),
                       growth = function("exponential { at_zero: 3 at_infinity: -1 scale: -40 }"),
                       wave = function("harmonic { mean: 1 cosine: 2 sine: -3 period: 7 }"),
                       turn = function("harmonic { cosine: 1 }");
  for (double c = -100; c <= 100; c += 0.37) {
    EXPECT_EQ(constant(c), -0.25);
    EXPECT_EQ(linear(c), 2 - 0.5 * c);
    EXPECT_NEAR(decay(c), -1 + 4 * std::exp(-c / 40), 1e-13 * std::exp(-c / 40) + 1e-15);
    EXPECT_NEAR(growth(c), -1 + 4 * std::exp(c / 40), 1e-13 * std::exp(c / 40) + 1e-15);
    const double angle = 2 * std::numbers::pi * c / 7;
    EXPECT_NEAR(wave(c), 1 + 2 * std::cos(angle) - 3 * std::sin(angle), 1e-13);
    EXPECT_NEAR(turn(c), std::cos(c), 1e-13);
  }
}

TEST(EffectFunction, StepsHoldFromTheirKnotOn) {
  const EffectFunction steps = function("steps { at: [10, 20] value: [1, 5, -2] }");
  EXPECT_EQ(steps(-1e9), 1);
  EXPECT_EQ(steps(9.999), 1);
  EXPECT_EQ(steps(10), 5);
  EXPECT_EQ(steps(19.999), 5);
  EXPECT_EQ(steps(20), -2);
  EXPECT_EQ(steps(1e9), -2);
}

TEST(EffectFunction, TablesAnswerByNumber) {
  const EffectFunction table = function("table { key: [3, 0, 7] value: [0.3, 0.1, 0.7] otherwise: -1 }");
  for (const auto& [key, value] :
       {std::pair{0, 0.1}, {1, -1.0}, {3, 0.3}, {6, -1.0}, {7, 0.7}, {8, -1.0}, {100000, -1.0}})
    EXPECT_EQ(table(key), value) << key;
  EXPECT_EQ(table(-1), -1);
  EXPECT_EQ(function("table { otherwise: 4 }")(2), 4);
}

TEST(EffectFunction, SplinesPassThroughTheirPointsAndStayAtTheirEnds) {
  const std::vector<double> knots = {-5, 0, 1, 4, 9}, values = {2, -1, 3, 3, 0.5};
  const EffectFunction spline = function("spline { knot: " + list(knots) + " value: " + list(values) + " }");
  for (std::size_t i = 0; i < knots.size(); ++i) EXPECT_NEAR(spline(knots[i]), values[i], 1e-14);
  EXPECT_EQ(spline(-100), 2);
  EXPECT_EQ(spline(100), 0.5);
  // The first and second derivatives are continuous; the second one is 0 at the ends.
  const double h = 1e-4;
  const auto slope = [&](double c) { return (spline(c + h) - spline(c - h)) / (2 * h); };
  const auto bend = [&](double c) { return (spline(c + h) - 2 * spline(c) + spline(c - h)) / (h * h); };
  for (const double knot : {0.0, 1.0, 4.0}) {
    EXPECT_NEAR(slope(knot - 2 * h), slope(knot + 2 * h), 1e-2);
    EXPECT_NEAR(bend(knot - 2 * h), bend(knot + 2 * h), 1e-2);
  }
  EXPECT_NEAR(bend(-5 + 2 * h), 0, 1e-2);
  EXPECT_NEAR(bend(9 - 2 * h), 0, 1e-2);
}

TEST(EffectFunction, SplinesReproduceALineAndApproximateASine) {
  std::vector<double> knots, lines, sines;
  for (int i = 0; i <= 40; ++i) {
    knots.push_back(i * 0.2 + 0.05 * std::sin(i));
    lines.push_back(3 - 2 * knots.back());
    sines.push_back(std::sin(knots.back()));
  }
  const EffectFunction line = function("spline { knot: " + list(knots) + " value: " + list(lines) + " }"),
                       sine = function("spline { knot: " + list(knots) + " value: " + list(sines) + " }");
  for (double c = 1; c < 7; c += 0.013) {
    EXPECT_NEAR(line(c), 3 - 2 * c, 1e-5);    // knots are printed with six decimals
    EXPECT_NEAR(sine(c), std::sin(c), 5e-5);  // the error of a cubic spline is 5/384 h^4
  }
}

TEST(EffectFunction, ASplineInTwoVariablesOfAProductIsTheProductOfSplines) {
  const std::vector<double> x = {-2, 0, 1, 3}, y = {0, 1, 4}, fx = {1, -1, 2, 0.5}, gy = {2, 3, -1};
  std::vector<double> values;
  for (const double g : gy) {
    for (const double f : fx) values.push_back(f * g);
  }
  const EffectFunction both = function("and_of: Y spline_2d { knot: " + list(x) + " and_knot: " + list(y) +
                                       " value: " + list(values) + " }"),
                       f = function("spline { knot: " + list(x) + " value: " + list(fx) + " }"),
                       g = function("spline { knot: " + list(y) + " value: " + list(gy) + " }");
  for (double c = -4; c < 5; c += 0.17) {
    for (double d = -2; d < 6; d += 0.23) EXPECT_NEAR(both(c, d), f(c) * g(d), 1e-13);
  }
}

TEST(EffectFunction, MultiplyAgreesWithTheScalarForm) {
  for (const char* const text : {"constant: 3", "linear { slope: 2 }", "spline { knot: [0, 1] value: [2, 4] }",
                                 "steps { at: 0.5 value: [1, 2] }", "harmonic { sine: 1 }",
                                 "table { key: 0 value: 9 }", "exponential { at_zero: 1 scale: 2 }"}) {
    const EffectFunction f = function(text);
    const std::vector<double> c = {0, 0.25, 0.5, 0.75, 1};
    std::vector<double> value(c.size(), 0.5);
    f.multiply(c, {}, value);
    for (std::size_t i = 0; i < c.size(); ++i) EXPECT_EQ(value[i], 0.5 * f(c[i])) << text;
  }
}

TEST(EffectFunction, ValuesAreFiniteForAnyCovariate) {
  std::mt19937 engine{5};
  const auto any = [&] {
    return std::ldexp(static_cast<double>(engine()) - 2147483648.0, static_cast<int>(engine() % 60) - 50);
  };
  const EffectFunction all[] = {function("linear { at_zero: 1e6 slope: -1e6 }"),
                                function("exponential { at_zero: 1e6 at_infinity: 1e6 scale: 1e-6 }"),
                                function("exponential { at_zero: 1e6 at_infinity: -1e6 scale: -1e-6 }"),
                                function("harmonic { sine: 1e6 period: 1e-6 }"),
                                function("spline { knot: [0, 1e-6, 2e-6] value: [1e6, -1e6, 1e6] }"),
                                function("steps { at: 0 value: [1, 2] }"),
                                function("table { key: 3 value: 1 }")};
  for (int i = 0; i < 20000; ++i) {
    const double c = any();
    for (const EffectFunction& f : all) ASSERT_TRUE(std::isfinite(f(c))) << c;
  }
}

TEST(EffectFunction, LargestBoundsTheFunction) {
  const struct {
    EffectFunction f;
    Range range;
  } cases[] = {{function("linear { at_zero: 1 slope: -2 }"), {-3, 10}},
               {function("exponential { at_zero: 5 scale: 3 }"), {0, 100}},
               {function("harmonic { mean: 1 sine: 2 }"), {-3, 3}},
               {function("spline { knot: [0, 1, 2, 3] value: [0, 9, -9, 0] }"), {-1, 2.5}},
               {function("steps { at: [1, 2] value: [0, -7, 3] }"), {0, 10}}};
  for (const auto& [f, range] : cases) {
    double most = 0;
    for (double c = range.min; c <= range.max; c += 1e-3) most = std::max(most, std::abs(f(c)));
    EXPECT_GE(f.largest(range, {0, 0}) * 1.05, most);
    EXPECT_LE(f.largest(range, {0, 0}), most * 1.6 + 1e-12);
  }
}

}  // namespace
}  // namespace kilotwin
