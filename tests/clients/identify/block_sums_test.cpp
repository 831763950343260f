// The sums of a model's blocks are those of the columns of their bases, for random models in random situations.
#include "clients/identify/model/block_sums.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <random>
#include <utility>

namespace kilotwin::identify {
namespace {

using Shape = Factor::Shape;

class Draws {
 public:
  explicit Draws(std::uint32_t seed) : engine_(seed) {}
  double between(double low, double high) { return std::uniform_real_distribution(low, high)(engine_); }
  std::uint32_t below(std::uint32_t n) { return std::uniform_int_distribution<std::uint32_t>(0, n - 1)(engine_); }

 private:
  std::mt19937 engine_;
};

Factor over(Shape shape, Covariate of, double high, std::uint32_t count) {
  Factor f;
  f.shape = shape;
  f.axis.of = of;
  f.high = high;
  f.count = count;
  return f;
}

Factor of_robots() {
  Factor f;
  f.shape = Shape::kTable;
  f.axis.of = Covariate::kRobot;
  f.points = {0, 2, 5};
  return f;
}

Factor map() {
  Factor f = over(Shape::kCosines2, Covariate::kX, 500, 3);
  f.and_axis.of = Covariate::kY;
  f.and_high = 400;
  f.first = 0;
  return f;
}

/// Few factors, so that blocks share some. One in four is a known curve.
Factor drawn_factor(Draws& draws) {
  const std::array<Factor, 6> all{
      over(Shape::kCosines, Covariate::kTime, 100, 4),     of_robots(),
      over(Shape::kHarmonics, Covariate::kHeading, 1, 2),  map(),
      over(Shape::kCosines, Covariate::kMotorTime, 50, 3), over(Shape::kLinear, Covariate::kSinceCommand, 10, 1)};
  Factor f = all[draws.below(all.size())];
  if (draws.below(4) != 0) return f;
  for (std::size_t i = 0; i < f.columns(); ++i) f.known.push_back(draws.between(-1, 1));
  return f;
}

Basis drawn_basis(Draws& draws) {
  Basis basis;
  const std::uint32_t factors = draws.below(4);
  for (std::uint32_t i = 0; i < factors; ++i) {
    basis.factors.push_back(drawn_factor(draws));
    if (basis.size() > kMostColumns) basis.factors.pop_back();
  }
  if (draws.below(3) == 0) {
    std::vector<std::uint32_t> chosen;
    for (std::uint32_t i = 0; i < basis.size(); ++i)
      if (draws.below(2) == 0) chosen.push_back(i);
    basis.chosen = chosen;  // none: all
  }
  return basis;
}

MotionModel drawn_model(Draws& draws) {
  MotionModel model;
  const std::uint32_t terms = 1 + draws.below(4);
  for (std::uint32_t t = 0; t < terms; ++t) {
    Term term;
    Eigen::Index columns = 0;
    const std::uint32_t blocks = 1 + draws.below(3);
    for (std::uint32_t b = 0; b < blocks; ++b) {
      const auto target = draws.below(5) == 0 ? Target::kMeasuredX : static_cast<Target>(draws.below(4));
      term.blocks.push_back({target, drawn_basis(draws), draws.below(3) == 0 ? kAlways : kDriven});
      columns += static_cast<Eigen::Index>(term.blocks.back().basis.size());
    }
    term.coefficients = Eigen::VectorXd::NullaryExpr(columns, [&] { return draws.between(-1, 1); });
    term.precision = Eigen::VectorXd::Ones(columns);
    model.terms.push_back(std::move(term));
  }
  return model;
}

Situation drawn_situation(Draws& draws) {
  Situation s;
  s.time_s = draws.between(0, 100);
  s.x_mm = draws.between(0, 500);
  s.y_mm = draws.between(0, 400);
  s.heading_rad = draws.between(-3, 3);
  s.robot = draws.below(6);
  s.commands.command = static_cast<Motion>(draws.below(4));
  s.commands.since_s = draws.between(0, 10);
  s.commands.motor_s = {draws.between(0, 50), draws.between(0, 50)};
  return s;
}

struct Value {
  double left, right;
};

/// By the columns themselves.
std::vector<Value> expected(const MotionModel& model, const Situation& s) {
  std::vector<Value> all;
  for (const Term& term : model.terms) {
    Eigen::Index next = 0;
    for (const Block& block : term.blocks) {
      const auto n = static_cast<Eigen::Index>(block.basis.size());
      const Eigen::VectorXd own = term.coefficients.segment(std::exchange(next, next + n), n);
      if (is_measured(block.target) || (block.during >> static_cast<int>(s.commands.command) & 1) == 0) continue;
      const auto sum = [&](std::size_t wheel) {
        std::array<double, kMostColumns> columns{};
        block.basis.evaluate(s, wheel, columns.data());
        return own.dot(Eigen::Map<const Eigen::VectorXd>(columns.data(), n));
      };
      all.push_back({sum(0), sum(1)});
    }
  }
  return all;
}

TEST(BlockSums, AreThoseOfTheColumns) {
  int blocks = 0;
  for (std::uint32_t seed = 0; seed < 300; ++seed) {
    Draws draws(seed);
    const MotionModel model = drawn_model(draws);
    BlockSums sums(model);
    for (int k = 0; k < 5; ++k) {
      const Situation s = drawn_situation(draws);
      std::vector<Value> found;
      BlockSums copy = sums;  // a copy has values of its own
      (k % 2 == 0 ? sums : copy).for_each(s, [&](const Block&, double left, double right) {
        found.push_back({left, right});
      });
      std::vector<Value> wanted = expected(model, s);
      // Blocks whose columns are all 0 may be left out.
      std::erase_if(wanted, [](const Value& v) { return v.left == 0 && v.right == 0; });
      std::erase_if(found, [](const Value& v) { return v.left == 0 && v.right == 0; });
      ASSERT_EQ(found.size(), wanted.size()) << "seed " << seed;
      for (std::size_t i = 0; i < found.size(); ++i) {
        EXPECT_NEAR(found[i].left, wanted[i].left, 1e-12) << "seed " << seed;
        EXPECT_NEAR(found[i].right, wanted[i].right, 1e-12) << "seed " << seed;
      }
      blocks += static_cast<int>(found.size());
    }
  }
  EXPECT_GT(blocks, 1000);
}

}  // namespace
}  // namespace kilotwin::identify
