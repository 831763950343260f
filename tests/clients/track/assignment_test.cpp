#include "clients/track/assignment.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

namespace kilotwin::track {
namespace {

double total(const Assignment& assignment, const std::vector<std::vector<double>>& cost, double alone) {
  double sum = 0;
  for (std::size_t i = 0; i < cost.size(); ++i)
    sum += assignment.of_track[i] ? cost[i][*assignment.of_track[i]] : alone;
  return sum;
}

/// The least cost by trying all assignments.
double by_trying(const std::vector<std::vector<double>>& cost, double alone) {
  const std::size_t rows = cost.size(), columns = cost.front().size();
  std::vector<std::size_t> order(rows + columns);
  std::iota(order.begin(), order.end(), std::size_t{0});
  double best = 1e18;
  do {
    double sum = 0;
    for (std::size_t i = 0; i < rows; ++i) sum += order[i] < columns ? std::min(cost[i][order[i]], 1e9) : alone;
    best = std::min(best, sum);
  } while (std::next_permutation(order.begin(), order.end()));
  return best;
}

TEST(Assignment, HasTheLeastCost) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> uniform(0, 20);
  constexpr double kAlone = 12, kGate = 15;
  for (int trial = 0; trial < 60; ++trial) {
    const std::size_t rows = 1 + random() % 4, columns = 1 + random() % 4;
    std::vector<std::vector<double>> cost(rows, std::vector<double>(columns, 1e9));
    std::vector<Pair> pairs;
    for (std::size_t i = 0; i < rows; ++i) {
      for (std::size_t j = 0; j < columns; ++j) {
        const double c = uniform(random);
        if (c > kGate) continue;
        cost[i][j] = c;
        pairs.push_back({i, j, c});
      }
    }
    const Assignment found = assign(rows, columns, pairs, kAlone, 0);
    EXPECT_NEAR(total(found, cost, kAlone), by_trying(cost, kAlone), 1e-9);
    std::vector<std::size_t> used;
    for (const auto& s : found.of_track) {
      if (s) used.push_back(*s);
    }
    std::sort(used.begin(), used.end());
    EXPECT_EQ(std::adjacent_find(used.begin(), used.end()), used.end()) << "two tracks share a measurement";
  }
}

TEST(Assignment, DoesNotDependOnTheOrderOfPairs) {
  std::vector<Pair> pairs{{0, 0, 1}, {0, 1, 2}, {1, 0, 2}, {1, 1, 3.5}, {2, 2, 1}};
  const Assignment one = assign(3, 3, pairs, 10, 1);
  std::reverse(pairs.begin(), pairs.end());
  const Assignment other = assign(3, 3, pairs, 10, 1);
  EXPECT_EQ(one.of_track, other.of_track);
  EXPECT_EQ(one.ambiguous, other.ambiguous);
  // 2 + 2 against 1 + 3.5: an exchange costs half a unit.
  EXPECT_TRUE(one.ambiguous[0] && one.ambiguous[1]);
  EXPECT_FALSE(one.ambiguous[2]);
}

}  // namespace
}  // namespace kilotwin::track
