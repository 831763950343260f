#include "clients/cli/sweep_points.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include "core/base/error.hpp"

namespace kilotwin::cli {
namespace {

std::vector<std::string> values(const std::string& text) {
  std::vector<std::string> values;
  for (const SweepPoint& point : sweep_points({"f=" + text})) values.push_back(point.at(0).substr(2));
  return values;
}

using Texts = std::vector<std::string>;

TEST(SweepPoints, RangesHaveStepsListsAndLogarithms) {
  EXPECT_EQ(values("1..4"), (Texts{"1", "2", "3", "4"}));
  EXPECT_EQ(values("10..50:20"), (Texts{"10", "30", "50"}));
  EXPECT_EQ(values("10..49:20"), (Texts{"10", "30"}));
  EXPECT_EQ(values("0..0.3:0.1"), (Texts{"0", "0.1", "0.2", "0.3"})) << "rounding does not lose the end";
  EXPECT_EQ(values("-1..1:0.5").size(), 5u);
  EXPECT_EQ(values("log:0.01..10:4"), (Texts{"0.01", "0.1", "1", "10"}));
  EXPECT_EQ(values("7,1..2,0.5,true"), (Texts{"7", "1", "2", "0.5", "true"}));
  EXPECT_EQ(values("\"a..b\""), (Texts{"\"a..b\""})) << "text is text";
  for (const char* wrong :
       {"0.1..1", "0..1:0", "0..1:-1", "log:1..10", "log:1..10:1", "log:1..10:2.5", "0..1e9:0.001"})
    EXPECT_THROW(static_cast<void>(values(wrong)), UserError) << wrong;
}

TEST(SweepPoints, ALatinHypercubeHasOnePointPerCellOfEachField) {
  constexpr std::size_t kPoints = 50;
  const auto points = latin_points({"a=0.0..1", "b=log:0.01..100", "c=1..50", "d=x,y"}, kPoints, 3);
  ASSERT_EQ(points.size(), kPoints);
  std::set<std::size_t> a, b;
  std::set<double> c;
  std::size_t x = 0;
  for (const SweepPoint& point : points) {
    a.insert(static_cast<std::size_t>(*number_of(point[0]) * kPoints));
    b.insert(static_cast<std::size_t>((std::log10(*number_of(point[1])) + 2) / 4 * kPoints));
    c.insert(*number_of(point[2]));
    x += point[3] == "d=x";
  }
  EXPECT_EQ(a.size(), kPoints);
  EXPECT_EQ(b.size(), kPoints);
  EXPECT_EQ(c.size(), kPoints) << "1..50 in 50 cells: each number once";
  EXPECT_EQ(x, kPoints / 2);
  EXPECT_EQ(points, latin_points({"a=0.0..1", "b=log:0.01..100", "c=1..50", "d=x,y"}, kPoints, 3));
  EXPECT_NE(points, latin_points({"a=0.0..1", "b=log:0.01..100", "c=1..50", "d=x,y"}, kPoints, 4));
  EXPECT_THROW(static_cast<void>(latin_points({}, 5, 1)), UserError);
  EXPECT_THROW(static_cast<void>(latin_points({"a=0..1:0.1"}, 5, 1)), UserError);
}

TEST(SweepPoints, AnyTextIsReadOrRefused) {
  std::mt19937_64 random(1);
  const std::vector<std::string> tokens{"1", "..", ":", "log:", ",", "-", ".", "0", "e9", "9", "x", "="};
  int read = 0;
  for (int i = 0; i < 100'000; ++i) {
    std::string text = "f=";
    for (std::size_t n = random() % 7; n > 0; --n) text += tokens[random() % tokens.size()];
    for (const bool latin : {false, true}) {
      try {
        read += !(latin ? latin_points({text}, 3, 1) : sweep_points({text})).empty();
      } catch (const UserError&) {}
    }
  }
  EXPECT_GT(read, 1000);
}

}  // namespace
}  // namespace kilotwin::cli
