// Candidate lists contain all bodies within the cutoff, however bodies moved since the last rebuild.
#include "services/physics/candidate_list.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "services/physics/merge.hpp"
#include "tests/services/physics/swarm.hpp"

namespace kilotwin {
namespace {

constexpr double kCutoff_mm = 35;

physics::Bodies bodies_of(const std::vector<testing::ScenePose>& poses) {
  physics::Bodies bodies;
  for (std::uint32_t r = 0; r < poses.size(); ++r) bodies.add(r, poses[r].x_mm, poses[r].y_mm, 0, 0, 1);
  return bodies;
}

void expect_holds_all(const physics::CandidateList& list, const physics::Bodies& bodies) {
  for (std::uint32_t i = 0; i < bodies.size(); ++i) {
    const auto candidates = list.of(i);
    ASSERT_TRUE(std::is_sorted(candidates.begin(), candidates.end()));
    ASSERT_FALSE(std::binary_search(candidates.begin(), candidates.end(), i));
    for (std::uint32_t j = 0; j < bodies.size(); ++j) {
      const double dx = bodies.x_mm[i] - bodies.x_mm[j], dy = bodies.y_mm[i] - bodies.y_mm[j];
      if (i == j || dx * dx + dy * dy > kCutoff_mm * kCutoff_mm) continue;
      ASSERT_TRUE(std::binary_search(candidates.begin(), candidates.end(), j)) << i << " and " << j;
    }
  }
}

TEST(CandidateList, ContainsEveryBodyThatCameNear) {
  physics::Bodies bodies = bodies_of(testing::random_crowd(200, 800, 800, 20, 6));
  physics::CandidateList list(kCutoff_mm);
  for (std::uint32_t k = 0; k < 100; ++k) {
    for (std::uint32_t i = 0; i < bodies.size(); ++i) {
      bodies.x_mm[i] += i % 2 == 0 ? 0.9 : -0.9;
      bodies.y_mm[i] += i % 3 == 0 ? 0.4 : -0.2;
    }
    if (k % 10 == 5) bodies.x_mm[k] = -bodies.x_mm[k];  // A tracked robot may jump.
    list.update(bodies);
    expect_holds_all(list, bodies);
  }
}

TEST(CandidateList, FollowsAChangeOfRobots) {
  auto poses = testing::random_crowd(60, 300, 300, 20, 2);
  physics::CandidateList list(kCutoff_mm);
  list.update(bodies_of(poses));
  physics::Bodies fewer = bodies_of(poses);
  for (auto* column : {&fewer.x_mm, &fewer.y_mm, &fewer.heading_rad}) column->erase(column->begin() + 10);
  fewer.robot.erase(fewer.robot.begin() + 10);
  list.update(fewer);
  expect_holds_all(list, fewer);
}

TEST(Merge, GivesRobotsInAscendingOrderWithTheirEntries) {
  physics::Merge merge(200);
  for (int round = 0; round < 2; ++round) {  // drain() empties the list.
    for (const std::uint32_t robot : {199u, 0u, 63u, 64u, 128u})
      EXPECT_TRUE(merge.add(robot, {robot % 3, robot + 7}));
    EXPECT_FALSE(merge.add(63, {0, 0})) << "each robot once";
    EXPECT_EQ(merge.size(), 5u);
    std::vector<std::uint32_t> order;
    merge.drain([&](std::uint32_t robot, physics::Merge::Entry entry) {
      order.push_back(robot);
      EXPECT_EQ(entry.list, robot % 3);
      EXPECT_EQ(entry.index, robot + 7);
    });
    EXPECT_EQ(order, (std::vector<std::uint32_t>{0, 63, 64, 128, 199}));
    EXPECT_EQ(merge.size(), 0u);
  }
}

}  // namespace
}  // namespace kilotwin
