#include "clients/recorder/expression.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>

#include "core/base/error.hpp"

namespace kilotwin::recorder {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

class Swarm {
 public:
  std::map<std::string, std::vector<double>> columns{{"hops", {0, 1, 2, 3, kNone}},
                                                     {"group", {0, 0, 1, 1, 1}},
                                                     {"x_mm", {-2, -1, 0, 1, 2}},
                                                     {"table[1].x", {5, 5, 5, 5, 5}},
                                                     {"red", {1}},
                                                     {"time_s", {10}}};
  [[nodiscard]] Expression parse(const std::string& text) const {
    return Expression::parse(text, [this](const std::string& name) {
      const auto found = columns.find(name);
      return found == columns.end()      ? NameKind::kUnknown
             : found->second.size() == 1 ? NameKind::kSingle
                                         : NameKind::kPerRobot;
    });
  }
  [[nodiscard]] double operator()(const std::string& text) const {
    return parse(text).value(
        5, [this](const std::string& name) -> const std::vector<double>& { return columns.at(name); });
  }
};

TEST(Expression, ReductionsFollowTheirDefinitions) {
  const Swarm value;
  EXPECT_EQ(value("mean(hops)"), 1.5) << "a robot without a value counts nowhere";
  EXPECT_EQ(value("sum(hops)"), 6);
  EXPECT_EQ(value("mean(hops, group == 1)"), 2.5);
  EXPECT_EQ(value("share(hops >= 2)"), 0.5);
  EXPECT_EQ(value("share(x_mm > 0, group == 1)"), 2.0 / 3);
  EXPECT_EQ(value("count(x_mm > 0)"), 2);
  EXPECT_EQ(value("median(x_mm)"), 0);
  EXPECT_EQ(value("quantile(x_mm, 0.25)"), -1);
  EXPECT_NEAR(value("quantile(hops, 0.9)"), 2.7, 1e-15) << "numpy.quantile([0, 1, 2, 3], 0.9)";
  EXPECT_NEAR(value("sd(x_mm)"), std::sqrt(2.5), 1e-15);
  EXPECT_EQ(value("min(hops) + max(hops)"), 3);
  EXPECT_EQ(value("mean(table[1].x)"), 5);
  EXPECT_EQ(value("mean((x_mm - mean(x_mm)) ^ 2)"), 2) << "reductions within per-robot values";
  EXPECT_TRUE(std::isnan(value("mean(hops, group == 7)")));
  EXPECT_EQ(value("count(hops, group == 7)"), 0);
}

TEST(Expression, OperatorsBindAsInArithmetic) {
  const Swarm value;
  EXPECT_EQ(value("1 + 2 * 3 ^ 2"), 19);
  EXPECT_EQ(value("-2 ^ 2"), -4);
  EXPECT_EQ(value("8 - 3 - 2"), 3);
  EXPECT_EQ(value("2 ^ 3 ^ 2"), 512);
  EXPECT_EQ(value("not 1 == 2 and 3 > 2"), 1);
  EXPECT_EQ(value("1 == 2 or 2 >= 2"), 1);
  EXPECT_EQ(value("time_s / 4"), 2.5);
  EXPECT_EQ(value("sqrt(abs(-9))"), 3);
  EXPECT_NEAR(value("cos(0) + sin(0)"), 1, 1e-15);
}

TEST(Expression, MistakesAreNamedWithTheirPlace) {
  const Swarm swarm;
  const std::pair<const char*, const char*> cases[] = {
      {"mean(hopz)", "character 6: there is no \"hopz\""},
      {"hops", "one value per robot; reduce it"},
      {"mean(hops", "expected , or )"},
      {"mean()", "expected a number, a name or ("},
      {"", "ends too early"},
      {"1 2", "something is left over"},
      {"meen(hops)", "there is no function \"meen\""},
      {"quantile(hops)", "takes 2 arguments"},
      {"mean(hops, 1, 2)", "takes 1 argument, and a condition"},
      {"quantile(hops, group)", "one number, 0 to 1"},
  };
  for (const auto& [text, what] : cases) {
    try {
      static_cast<void>(swarm.parse(text));
      ADD_FAILURE() << text;
    } catch (const UserError& error) {
      EXPECT_NE(std::string(error.what()).find(what), std::string::npos) << error.what();
    }
  }
  EXPECT_THROW(static_cast<void>(swarm.parse(std::string(2000, '1'))), UserError);
  EXPECT_THROW(static_cast<void>(swarm.parse(std::string(900, '('))), UserError) << "no stack is that deep";
  EXPECT_THROW(static_cast<void>(swarm.parse(std::string(900, '-') + "1")), UserError);
}

/// Random expressions as text, with the value that they must have.
class Oracle {
 public:
  explicit Oracle(std::uint64_t seed) : random_(seed) {}
  std::pair<std::string, double> operator()(int depth) {
    const auto pick = depth == 0 ? random_() % 2 : random_() % 7;
    if (pick == 0) {
      const double number = static_cast<double>(random_() % 64) / 4;
      return {fmt::format("{}", number), number};
    }
    if (pick == 1) return {"time_s", 10};
    const auto [a, x] = (*this)(depth - 1);
    const auto [b, y] = (*this)(depth - 1);
    switch (pick) {
      case 2: return {fmt::format("({} + {})", a, b), x + y};
      case 3: return {fmt::format("({} - {})", a, b), x - y};
      case 4: return {fmt::format("({} * {})", a, b), x * y};
      case 5: return {fmt::format("({} <= {})", a, b), x <= y ? 1.0 : 0.0};
      default: return {fmt::format("mean({} + 0 * x_mm)", a), x};
    }
  }

 private:
  std::mt19937_64 random_;
};

TEST(Expression, RandomExpressionsHaveTheirValue) {
  const Swarm value;
  Oracle oracle(3);
  for (int i = 0; i < 3000; ++i) {
    const auto [text, expected] = oracle(3);
    if (text.size() > Expression::kLongest) continue;
    EXPECT_NEAR(value(text), expected, 1e-9 * (1 + std::abs(expected))) << text;
  }
}

TEST(Expression, AnyTextIsReadOrRefused) {
  const Swarm swarm;
  const std::vector<std::string> tokens{"mean",   "(",     ")",   "hops", ",",          "group", "==",       "1",
                                        ".5",     "share", "-",   "^",    "and",        "not",   "quantile", "x_mm",
                                        "time_s", " ",     "/",   "0",    "table[1].x", "[",     "or",       "\xff",
                                        "1e999",  "<",     "red", "sqrt", "1e",         "->",    "::"};
  std::mt19937_64 random(5);
  int read = 0;
  for (int i = 0; i < 50'000; ++i) {
    std::string text;
    for (std::size_t n = 1 + random() % 9; n > 0; --n) text += tokens[random() % tokens.size()];
    try {
      static_cast<void>(swarm(text));
      ++read;
    } catch (const UserError&) {}
  }
  EXPECT_GT(read, 300) << "the grammar is reached";
}

}  // namespace
}  // namespace kilotwin::recorder
