// Link margins: every term of the propagation model, its bounds, and its effect on reception.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "core/random/random.hpp"
#include "services/comm/link_budget.hpp"
#include "tests/services/comm/fake_hosts.hpp"

namespace kilotwin::comm {
namespace {

using testing::make_plan;
using testing::ScenePose;
using testing::Swarm;

/// A model without spread: 0.1 dB/mm, margin 0 at 100 mm.
const std::string kNominal =
    "decay_db_per_mm: 0.1 power_sd_db: 0 sensitivity_sd_db: 0 power_bearing_sd_db: 0 sensitivity_bearing_sd_db: 0 "
    "link_sd_db: 0 packet_sd_db: 0 ";

std::string radio(const std::string& propagation) {
  return "radio { model: PROPAGATION range_mm: 100 oscillator_sd: 0 propagation { " + propagation + " } }";
}

struct Medium {
  explicit Medium(const RunPlan& plan) : links(plan), robots(links.reach_mm(), links.span_mm(), plan.robots()) {
    for (std::uint32_t i = 0; i < plan.robots(); ++i) {
      const Pose pose = plan.initial_pose(i);
      robots.place(i, pose.x_mm, pose.y_mm);
      links.turn(i, pose.heading_rad);
    }
    robots.sort();
  }
  [[nodiscard]] double margin(std::uint32_t sender, std::uint32_t receiver) {
    return links.margin_db(robots, sender, receiver);
  }
  LinkBudget links;
  Neighbourhood robots;
};

TEST(LinkBudget, MarginDecreasesWithDistance) {
  const RunPlan plan = make_plan(radio(kNominal), {{0, 0, 0}, {60, 80, 0}, {0, -40, 0}});
  Medium air(plan);
  EXPECT_NEAR(air.margin(0, 1), 0, 1e-12);
  EXPECT_NEAR(air.margin(0, 2), 6, 1e-12);
  EXPECT_EQ(air.links.gains(6), Ranging().gains(40));
  EXPECT_DOUBLE_EQ(air.links.reach_mm(), 100);
}

TEST(LinkBudget, AppliesParametersOfRobotsAndPairs) {
  const RunPlan plan =
      make_plan(radio(kNominal +
                      "robot { robot: 0 power_db: 1.5 sensitivity_db: -2 } robot { robot: 1 power_db: -1 } "
                      "link { sender: 1 receiver: 0 offset_db: 0.25 } link { sender: 0 receiver: 7 offset_db: 9 }"),
                {{0, 0, 0}, {50, 0, 0}});
  Medium air(plan);
  EXPECT_NEAR(air.margin(0, 1), 5 + 1.5, 1e-12);
  EXPECT_NEAR(air.margin(1, 0), 5 - 1 - 2 + 0.25, 1e-12);
}

/// A sender that is 2 dB stronger ahead than aside, turned by 30 degrees; receivers in all directions.
TEST(LinkBudget, MarginDependsOnTheBearing) {
  const double turn = 3.14159265358979 / 6;
  std::vector<ScenePose> poses{{0, 0, turn}};
  for (int k = 0; k < 12; ++k) poses.push_back({50 * std::cos(k * turn), 50 * std::sin(k * turn), 1.0 * k});
  const RunPlan plan = make_plan(
      radio(kNominal + "robot { robot: 0 power_ahead_db: 2 power_left_db: 1 sensitivity_left_db: -3 }"), poses);
  Medium air(plan);
  for (std::uint32_t k = 0; k < 12; ++k) {
    const double bearing = k * turn - turn;
    EXPECT_NEAR(air.margin(0, k + 1), 5 + 2 * std::cos(bearing) + std::sin(bearing), 1e-9) << k;
    EXPECT_NEAR(air.margin(k + 1, 0), 5 - 3 * std::sin(bearing), 1e-9) << k;
  }
}

TEST(LinkBudget, BodiesOnTheLineReduceTheMargin) {
  // Positions: on the line; half a radius beside it; more than a radius beside it; beyond the receiver.
  const RunPlan plan = make_plan(radio(kNominal + "body_loss_db: 2"),
                                 {{0, 0, 0}, {160, 0, 0}, {40, 0, 0}, {80, 8.25, 0}, {120, -17, 0}, {200, 0, 0}});
  Medium air(plan);
  const double crossed = 1 + std::sqrt(0.75);
  EXPECT_NEAR(air.robots.bodies_between(0, 1, 16.5), crossed, 1e-12);
  EXPECT_NEAR(air.margin(0, 1), -6 - 2 * crossed, 1e-12);
  EXPECT_NEAR(air.margin(1, 0), -6 - 2 * crossed, 1e-12);
  EXPECT_NEAR(air.margin(0, 2), 6, 1e-12);
}

/// A column of discs here and elsewhere in the plane, where the cells of the grid lie otherwise.
TEST(LinkBudget, ShadowsDoNotDependOnThePosition) {
  for (const double x : {0.0, 77.3, -901.4}) {
    std::vector<ScenePose> poses;
    for (int i = 0; i < 6; ++i) poses.push_back({x + 33.5 * i, x / 2, 0});
    const RunPlan plan = make_plan(radio(kNominal + "body_loss_db: 1"), poses);
    Medium air(plan);
    EXPECT_NEAR(air.robots.bodies_between(0, 5, 16.5), 4, 1e-9) << x;
    EXPECT_NEAR(air.robots.bodies_between(4, 1, 16.5), 2, 1e-9) << x;
  }
}

std::vector<ScenePose> random_poses(std::uint32_t count, double side_mm) {
  const Random random(5);
  std::vector<ScenePose> poses;
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto place = random.uniform_pair(Stream::kLayout, i, Tick{0}, 0);
    poses.push_back({side_mm * (place[0] - 0.5), side_mm * (place[1] - 0.5),
                     6 * random.uniform(Stream::kLayout, i, Tick{0}, 2) - 3});
  }
  return poses;
}

/// Short cuts by distance agree with the margin, and no robot is heard beyond the reach.
TEST(LinkBudget, HearsWhereTheMarginIsAboveZero) {
  for (const std::string extra : {"", "body_loss_db: 3", "link { sender: 3 receiver: 4 offset_db: 40 }"}) {
    const RunPlan plan = make_plan(radio(extra), random_poses(150, 800));
    Medium air(plan);
    std::uint32_t heard = 0;
    for (std::uint32_t a = 0; a < 150; ++a) {
      for (std::uint32_t b = 0; b < 150; ++b) {
        if (a == b) continue;
        const bool above = air.margin(a, b) > 0;
        ASSERT_EQ(air.links.hears(air.robots, b, a), above) << a << " to " << b << ", " << extra;
        ASSERT_TRUE(!above || std::sqrt(air.robots.square(a, b)) <= air.links.reach_mm());
        heard += above;
      }
    }
    EXPECT_GT(heard, 500u);
  }
}

/// The spread over robots and pairs is as the model states. The margin of a pair at 50 mm is 5 + power + sensitivity + both
/// bearings + link. 2000 disjoint, hence independent, pairs; bounds of 4.5 standard errors.
TEST(LinkBudget, SpreadsMatchTheModel) {
  constexpr std::uint32_t kPairs = 2000;
  std::vector<ScenePose> poses;
  for (std::uint32_t i = 0; i < kPairs; ++i) {
    const double x = 900.0 * (i % 50), y = 900.0 * (i / 50);
    poses.push_back({x, y, 0.3 * i});
    poses.push_back({x + 50, y, -0.7 * i});
  }
  const RunPlan plan =
      make_plan(radio("decay_db_per_mm: 0.1 power_sd_db: 1 sensitivity_sd_db: 2 power_bearing_sd_db: 0.5 "
                      "sensitivity_bearing_sd_db: 0.25 link_sd_db: 0.75"),
                poses);
  Medium air(plan);
  double sum = 0, squares = 0;
  for (std::uint32_t i = 0; i < kPairs; ++i) {
    const double deviation = air.margin(2 * i, 2 * i + 1) - 5;
    sum += deviation;
    squares += deviation * deviation;
  }
  const double variance = 1 + 4 + 0.25 + 0.0625 + 0.5625;
  EXPECT_NEAR(sum / kPairs, 0, 4.5 * std::sqrt(variance / kPairs));
  EXPECT_NEAR(squares / kPairs, variance, 4.5 * variance * std::sqrt(2.0 / kPairs));
}

/// At a margin of 0, half of the packets are received; at one standard deviation above it, 84 %. One receiver per sender, 400
/// isolated senders, 25 packets each.
TEST(LinkBudget, PacketsFadeIndependently) {
  for (const auto& [distance, share] : {std::pair{100.0, 0.5}, std::pair{90.0, 0.8413}}) {
    std::vector<ScenePose> poses;
    for (int i = 0; i < 400; ++i) {
      poses.push_back({900.0 * (i % 20), 900.0 * (i / 20), 0});
      poses.push_back({900.0 * (i % 20) + distance, 900.0 * (i / 20), 0});
    }
    std::string model = kNominal;
    model.replace(model.find("packet_sd_db: 0"), 15, "packet_sd_db: 1");
    const RunPlan plan = make_plan(radio(model), poses);
    Swarm swarm(plan);
    for (std::uint32_t i = 0; i < 400; ++i) swarm.hosts.sends[2 * i + 1] = 0;
    for (int k = 0; k < 17 * 25; ++k) swarm.step();
    const auto& c = swarm.radio.counters();
    ASSERT_GT(c.sent, 9000u);
    const double sent = static_cast<double>(c.sent), sd = std::sqrt(share * (1 - share) / sent);
    EXPECT_NEAR(static_cast<double>(c.received) / sent, share, 4.5 * sd + 0.005) << distance;
  }
}

/// Robot 1 is strong, robot 0 weak: each link depends on its own direction only.
TEST(LinkBudget, LinksMayBeOneWay) {
  const RunPlan plan = make_plan(radio(kNominal + "robot { robot: 0 power_db: -3 } robot { robot: 1 power_db: 3 }"),
                                 {{0, 0, 0}, {100, 0, 0}});
  Swarm swarm(plan);
  std::vector<int> heard(2, 0);
  for (int k = 0; k < 400; ++k) {
    swarm.step();
    for (const RadioFrame& frame : swarm.frames)
      for (const std::uint32_t robot : frame.reception_robot) ++heard[robot];
  }
  EXPECT_GT(heard[0], 20);
  EXPECT_EQ(heard[1], 0);
}

/// A - B - C in a row; A and C are hidden from each other, and A is 30 mm closer to B. Without capture they destroy each
/// other's packets. With a capture threshold of 2 dB, B receives A's packets and not C's.
TEST(LinkBudget, CapturesTheStrongerPacket) {
  const auto collided_of = [](const std::string& capture) {
    std::vector<ScenePose> poses;
    for (int i = 0; i < 300; ++i) {
      const double x = 900.0 * (i % 20), y = 900.0 * (i / 20);
      poses.insert(poses.end(), {{x - 50, y, 0}, {x, y, 0}, {x + 80, y, 0}});
    }
    const RunPlan plan = make_plan(radio(kNominal + capture), poses);
    Swarm swarm(plan);
    for (std::uint32_t i = 0; i < 300; ++i) swarm.hosts.sends[3 * i + 1] = 0;
    for (int k = 0; k < 600; ++k) swarm.step();
    return static_cast<double>(swarm.radio.counters().collided);
  };
  const double without = collided_of("capture_db: 60"), with = collided_of("capture_db: 2");
  EXPECT_GT(without, 100);
  EXPECT_NEAR(with, without / 2, 4.5 * std::sqrt(without));
}

}  // namespace
}  // namespace kilotwin::comm
