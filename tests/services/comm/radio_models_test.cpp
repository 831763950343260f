// The channel's models against closed forms: hidden terminals, the simple model of the ARGoS paper, counts of single robots, and
// distances by robots' own tables.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <string>

#include "core/model/radio_parameters.hpp"
#include "idl/checkpoint.pb.h"
#include "services/comm/link_budget.hpp"
#include "tests/services/comm/fake_hosts.hpp"

namespace kilotwin::comm {
namespace {

using testing::make_plan;
using testing::ScenePose;
using testing::Swarm;

/// `count` copies of a row of robots at these positions, out of each other's range.
std::vector<ScenePose> rows_of(int count, const std::vector<double>& x_mm) {
  std::vector<ScenePose> poses;
  for (int i = 0; i < count; ++i) {
    for (const double x : x_mm) poses.push_back({1500.0 * (i % 25) + x, 1500.0 * (i / 25), 0});
  }
  return poses;
}

double sum_of(const std::vector<RadioCount>& counts, std::uint32_t RadioCount::*field) {
  double sum = 0;
  for (const RadioCount& count : counts) sum += count.*field;
  return sum;
}

/// A and C do not hear each other, B between them hears both. With equal rates and uniform phases in a tick of length T, they
/// collide at B always or never: with probability 1 - (1 - P / T)^2, with the packet's length P.
TEST(HiddenTerminals, CollideAsPredictedFromPhases) {
  constexpr int kRows = 600;
  const RunPlan plan = make_plan("radio { range_mm: 100 oscillator_sd: 0 }", rows_of(kRows, {-80, 0, 80}));
  Swarm swarm(plan);
  for (std::uint32_t i = 0; i < kRows; ++i) swarm.hosts.sends[3 * i + 1] = 0;
  for (int k = 0; k < 200; ++k) swarm.step();
  const auto& c = swarm.radio.counters();
  const double part = static_cast<double>(kPacket) / (kTimerCounts * kTimerCount),
               law = 1 - (1 - part) * (1 - part);
  EXPECT_NEAR(static_cast<double>(c.collided) / static_cast<double>(c.sent), law,
              4.5 * std::sqrt(law * (1 - law) / kRows) + 0.002);
  EXPECT_EQ(c.aborted, 0u);
}

/// If all robots hear each other, each waits for the others, and no packet is lost.
TEST(CarrierSense, LosesNoPacketIfAllRobotsHearEachOther) {
  const RunPlan plan = make_plan("radio { range_mm: 1000 }", testing::grid_crowd(20, 40, testing::Facing::kRight));
  Swarm swarm(plan);
  for (int k = 0; k < 3000; ++k) swarm.step();
  const auto& c = swarm.radio.counters();
  EXPECT_GT(c.sent, 20u * 3000 / 20);
  EXPECT_LT(static_cast<double>(c.collided), 0.01 * static_cast<double>(c.received));
}

TEST(RadioCounts, OfRobotsAddUp) {
  const RunPlan plan =
      make_plan("radio { model: PROPAGATION }", testing::grid_crowd(60, 45, testing::Facing::kRandom));
  Swarm swarm(plan);
  for (int k = 0; k < 500; ++k) swarm.step();
  const auto& c = swarm.radio.counters();
  const auto& each = swarm.radio.radio_counts();
  ASSERT_EQ(each.size(), 60u);
  EXPECT_EQ(sum_of(each, &RadioCount::attempted), static_cast<double>(c.attempted));
  EXPECT_EQ(sum_of(each, &RadioCount::sent), static_cast<double>(c.sent));
  EXPECT_EQ(sum_of(each, &RadioCount::received), static_cast<double>(c.received));
  EXPECT_EQ(sum_of(each, &RadioCount::collided), static_cast<double>(c.collided));
  EXPECT_EQ(sum_of(each, &RadioCount::backed_off), static_cast<double>(c.aborted));
  EXPECT_GT(c.received, 1000u);
  proto::RadioState saved;
  swarm.radio.save(saved);
  RadioEngine loaded(plan);
  const proto::RadioState* const parts[] = {&saved};
  loaded.load(swarm.now, parts);
  EXPECT_EQ(loaded.radio_counts(), each);
}

std::string simple(const std::string& model) {
  return "radio { model: SIMPLE range_mm: 100 simple { " + model + " } }";
}

/// A lone robot sends once per interval on average, however the interval falls on ticks.
TEST(SimpleRadio, LimitsTheRate) {
  const RunPlan plan = make_plan(simple("interval_s: 0.5 sending_error: 0"), {{0, 0, 0}});
  Swarm swarm(plan);
  while (static_cast<double>(swarm.now.count()) * 0.032768 < 500) swarm.step();
  EXPECT_NEAR(static_cast<double>(swarm.radio.counters().sent), 1000, 2);
}

TEST(SimpleRadio, FailsAndDropsAtTheStatedRates) {
  const RunPlan plan = make_plan(simple("interval_s: 0 sending_error: 0.2 drop_probability: 0.3 contention: 0"),
                                 rows_of(300, {0, 50}));
  Swarm swarm(plan);
  for (std::uint32_t i = 0; i < 300; ++i) swarm.hosts.sends[2 * i + 1] = 0;
  for (int k = 0; k < 120; ++k) swarm.step();
  const auto& c = swarm.radio.counters();
  const auto share = [](std::uint64_t part, std::uint64_t of) {
    return static_cast<double>(part) / static_cast<double>(of);
  };
  const auto bound = [](double p, std::uint64_t of) {
    return 4.5 * std::sqrt(p * (1 - p) / static_cast<double>(of));
  };
  ASSERT_GT(c.sent, 5000u);
  EXPECT_NEAR(share(c.aborted, c.attempted), 0.2, bound(0.2, c.attempted));
  EXPECT_NEAR(share(c.faded, c.sent), 0.3, bound(0.3, c.sent));
  EXPECT_EQ(c.received + c.faded, c.sent);
}

/// Two senders in range of a third, all in the same ticks: each is lost with the probability of contention.
TEST(SimpleRadio, ContentionHasTheStatedProbability) {
  const RunPlan plan =
      make_plan(simple("interval_s: 0 sending_error: 0 contention: 0.4"), rows_of(300, {0, 60, 120}));
  Swarm swarm(plan);
  for (std::uint32_t i = 0; i < 300; ++i) swarm.hosts.sends[3 * i + 1] = 0;
  for (int k = 0; k < 60; ++k) swarm.step();
  const auto& c = swarm.radio.counters();
  ASSERT_GT(c.sent, 5000u);
  EXPECT_EQ(c.received + c.collided, c.sent);
  EXPECT_NEAR(static_cast<double>(c.collided) / static_cast<double>(c.sent), 0.4,
              4.5 * std::sqrt(0.24 / static_cast<double>(c.sent)));
}

struct Air {
  explicit Air(const RunPlan& plan) : links(plan), robots(links.reach_mm(), links.span_mm(), plan.robots()) {
    for (std::uint32_t i = 0; i < plan.robots(); ++i) {
      const Pose pose = plan.initial_pose(i);
      robots.place(i, pose.x_mm, pose.y_mm);
    }
    robots.sort();
  }
  LinkBudget links;
  Neighbourhood robots;
};

const std::string kExactClocks =
    "decay_db_per_mm: 0.1 power_sd_db: 0 sensitivity_sd_db: 0 power_bearing_sd_db: 0 sensitivity_bearing_sd_db: 0 "
    "packet_sd_db: 0 ";

/// Only parameters that `model` states have random values.
std::string propagation(const std::string& model) {
  const std::string link = model.find("link_sd_db") == std::string::npos ? "link_sd_db: 0 " : "";
  return "radio { model: PROPAGATION range_mm: 100 propagation { " + kExactClocks + link + model + " } }";
}

TEST(LinkBudget, AppliesTheCommonPattern) {
  std::vector<ScenePose> poses{{0, 0, 0.4}};
  for (int k = 0; k < 8; ++k) poses.push_back({50 * std::cos(0.8 * k), 50 * std::sin(0.8 * k), -0.3 * k});
  const RunPlan plan =
      make_plan(propagation("power_pattern_db: 1 power_pattern_db: 0 power_pattern_db: 0.5 power_pattern_db: -0.25 "
                            "sensitivity_pattern_db: 0 sensitivity_pattern_db: 2"),
                poses);
  Air air(plan);
  for (std::uint32_t k = 0; k < 8; ++k) {
    const double from = 0.8 * k - 0.4, at = 0.8 * k + 3.14159265358979 + 0.3 * k;
    EXPECT_NEAR(air.links.margin_db(air.robots, 0, k + 1),
                5 + std::cos(from) + 0.5 * std::cos(2 * from) - 0.25 * std::sin(2 * from) + 2 * std::sin(at), 1e-9);
  }
}

/// Both directions of a pair share pair_sd_db, run_sd_db adds to known links, and known links are not drawn.
TEST(LinkBudget, DrawsPairsLinksAndRuns) {
  const std::vector<ScenePose> poses = rows_of(200, {0, 60});
  const auto margins = [&](const std::string& model, std::uint64_t seed, bool back) {
    const RunPlan plan = make_plan(propagation(model) + " seed: " + std::to_string(seed), poses);
    Air air(plan);
    std::vector<double> result;
    for (std::uint32_t i = 0; i < 400; i += 2)
      result.push_back(back ? air.links.margin_db(air.robots, i + 1, i)
                            : air.links.margin_db(air.robots, i, i + 1));
    return result;
  };
  EXPECT_EQ(margins("pair_sd_db: 1", 1, false), margins("pair_sd_db: 1", 1, true));
  EXPECT_NE(margins("link_sd_db: 1", 1, false), margins("link_sd_db: 1", 1, true));
  EXPECT_NE(margins("pair_sd_db: 1", 1, false), margins("pair_sd_db: 1", 2, false));
  const std::string known = "pair_sd_db: 1 link { sender: 4 receiver: 5 offset_db: 0.75 } ";
  EXPECT_NEAR(margins(known, 1, false)[2], 4.75, 1e-6);
  EXPECT_NE(margins(known + "run_sd_db: 0.5", 1, false)[2], margins(known + "run_sd_db: 0.5", 2, false)[2]);
}

/// A sensitive robot has higher readings, and its own table accounts for them: estimates of a nominal sender are correct.
TEST(Ranging, OwnTablesCompensateOwnSensitivity) {
  const RunPlan plan =
      make_plan(propagation("robot { robot: 1 sensitivity_db: 1.5 }"), {{0, 0, 0}, {63, 0, 0}, {0, 500, 0}});
  Air air(plan);
  const RadioParameters parameters(plan);
  const RangingTable own = parameters.table(1), nominal = parameters.table(0);
  EXPECT_TRUE(parameters.own_tables());
  const Gains gains = air.links.gains(air.links.margin_db(air.robots, 0, 1));
  EXPECT_EQ(gains.high, own.high[6]);  // 33 + 6 * 5 mm
  EXPECT_EQ(gains.low, own.low[6]);
  EXPECT_GT(own.low[6], nominal.low[6]);
  const std::uint16_t low[] = KILOTWIN_IR_LOW, high[] = KILOTWIN_IR_HIGH;
  EXPECT_EQ(std::memcmp(nominal.low.data(), low, sizeof low), 0);
  EXPECT_EQ(std::memcmp(nominal.high.data(), high, sizeof high), 0);
}

/// Readings have the stated standard deviation, in dB, about their values without noise.
TEST(Ranging, ReadingNoiseMatchesTheModel) {
  const RunPlan plan = make_plan(propagation("reading_sd_db: 0.2"), {{0, 0, 0}, {60, 0, 0}});
  const LinkBudget links(plan);
  const double exact = links.gains(4).low;
  double sum = 0, squares = 0;
  constexpr int kReadings = 4000;
  for (int k = 0; k < kReadings; ++k) {
    const double db = 10 * std::log10(links.readings(0, 1, k, 4).low / exact);
    sum += db;
    squares += db * db;
  }
  EXPECT_NEAR(sum / kReadings, 0, 4.5 * 0.2 / std::sqrt(kReadings) + 0.005);
  EXPECT_NEAR(std::sqrt(squares / kReadings), 0.2, 0.2 * 4.5 / std::sqrt(2.0 * kReadings) + 0.005);
}

}  // namespace
}  // namespace kilotwin::comm
