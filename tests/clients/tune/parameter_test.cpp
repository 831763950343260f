#include "clients/tune/parameter.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>

#include "core/base/error.hpp"

namespace kilotwin::tune {
namespace {

std::string error_of(const std::string& text) {
  try {
    static_cast<void>(parse_parameter(text, "--vary", false));
  } catch (const UserError& error) {
    return error.what();
  }
  return {};
}

TEST(TuneParameter, CoversItsRange) {
  const Parameter p = parse_parameter("motion.speed_mm_s=-2.5..7.5", "--vary", false);
  EXPECT_EQ(p.name, "motion.speed_mm_s");
  EXPECT_FALSE(p.whole);
  EXPECT_DOUBLE_EQ(value_at(p, 0), -2.5);
  EXPECT_DOUBLE_EQ(value_at(p, 1), 7.5);
  EXPECT_DOUBLE_EQ(value_at(p, 0.5), 2.5);
  EXPECT_DOUBLE_EQ(value_at(p, 2), 7.5);  // never beyond
  EXPECT_EQ(setting_at(p, 0.5), "motion.speed_mm_s=2.5");
}

TEST(TuneParameter, EqualRatiosAreEqualStepsWhereItIsLogarithmic) {
  const Parameter p = parse_parameter("x=log:0.01..100.0", "--vary", false);
  for (const double place : {0.0, 0.2, 0.4, 0.6})
    EXPECT_NEAR(value_at(p, place + 0.2) / value_at(p, place), std::pow(1e4, 0.2), 1e-9);
}

TEST(TuneParameter, WholeNumbersHaveEqualShares) {
  const Parameter p = parse_parameter("robots.count=3..6", "--vary", false);
  std::map<double, int> seen;
  constexpr int kSteps = 4000;
  for (int i = 0; i < kSteps; ++i) ++seen[value_at(p, (i + 0.5) / kSteps)];
  ASSERT_EQ(seen.size(), 4u);
  for (const auto& [value, count] : seen) EXPECT_EQ(count, kSteps / 4) << value;
  EXPECT_EQ(setting_at(p, 1), "robots.count=6");
}

TEST(TuneParameter, ErrorsNameTheOptionAndTheText) {
  for (const char* text :
       {"x", "=1..2", "x=1", "x=1..", "x=a..b", "x=2..1", "x=1..1", "x=log:0..1", "x=1..inf", "x=1..2..3"}) {
    const std::string error = error_of(text);
    EXPECT_NE(error.find("--vary"), std::string::npos) << text << ": " << error;
    EXPECT_NE(error.find(text), std::string::npos) << text << ": " << error;
  }
}

}  // namespace
}  // namespace kilotwin::tune
