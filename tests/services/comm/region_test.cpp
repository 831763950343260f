// A channel divided into regions gives the same frames and counts as an undivided one.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <string>
#include <tuple>

#include "tests/services/comm/fake_hosts.hpp"

namespace kilotwin::comm {
namespace {

constexpr std::uint32_t kCrowd = 300;
constexpr double kWide_mm = 2400, kHigh_mm = 300;

/// A reception: receiver, message, readings.
using Receipt = std::tuple<std::uint32_t, IrMessage, std::int16_t, std::int16_t>;

struct Seen {
  std::vector<int> kilo_ticks;
  std::vector<std::uint32_t> ask, sent;
  std::vector<Receipt> receipts;
  RadioEngine::Counters counters;

  explicit Seen(std::uint32_t robots) : kilo_ticks(robots, 0) {}
  void add(const RadioEngine& engine, const RadioFrame& frame) {
    for (std::size_t i = 0; i < kilo_ticks.size(); ++i) kilo_ticks[i] += frame.kilo_ticks[i];
    ask.insert(ask.end(), frame.ask.begin(), frame.ask.end());
    sent.insert(sent.end(), frame.sent.begin(), frame.sent.end());
    for (std::size_t n = 0; n < frame.reception_robot.size(); ++n) {
      receipts.emplace_back(frame.reception_robot[n], frame.messages[frame.reception_message[n]],
                            frame.reception_high_gain[n], frame.reception_low_gain[n]);
    }
    const RadioEngine::Counters& c = engine.counters();
    counters.attempted += c.attempted;
    counters.sent += c.sent;
    counters.received += c.received;
    counters.collided += c.collided;
    counters.aborted += c.aborted;
    std::sort(ask.begin(), ask.end());
    std::sort(sent.begin(), sent.end());
    // Receptions of one robot keep their order.
    std::stable_sort(receipts.begin(), receipts.end(),
                     [](const Receipt& a, const Receipt& b) { return std::get<0>(a) < std::get<0>(b); });
  }
  [[nodiscard]] RadioFrame frame() const {
    RadioFrame frame;
    frame.kilo_ticks.assign(kilo_ticks.begin(), kilo_ticks.end());
    frame.ask = ask;
    frame.sent = sent;
    return frame;
  }
};

class Regions : public ::testing::TestWithParam<std::tuple<const char*, std::vector<Region>>> {};

TEST_P(Regions, SumToTheUndividedChannel) {
  const auto& [radio, regions] = GetParam();
  const Random random(7);
  const auto draw = [&](std::uint32_t robot, int tick, std::uint32_t number) {
    return random.uniform(Stream::kLayout, robot, Tick{tick}, number);
  };
  std::vector<testing::ScenePose> poses;
  for (std::uint32_t i = 0; i < kCrowd; ++i)
    poses.push_back({kWide_mm * (draw(i, 0, 0) - 0.5), kHigh_mm * (draw(i, 0, 1) - 0.5), 6 * draw(i, 0, 2)});
  const RunPlan plan = testing::make_plan(radio, poses);
  testing::FakeHosts hosts(plan);
  RadioEngine whole(plan);
  std::vector<std::unique_ptr<RadioEngine>> parts;
  for (const Region& region : regions) parts.push_back(std::make_unique<RadioEngine>(plan, nullptr, region));
  std::vector<std::vector<RadioGhosts>> ghosts(parts.size(), std::vector<RadioGhosts>(parts.size()));
  std::uint32_t crossed = 0;
  for (Tick now; now.count() < 400; ++now) {
    for (std::size_t from = 0; from < parts.size(); ++from) {
      for (std::size_t to = 0; to < parts.size(); ++to) parts[from]->emit_ghosts(regions[to], ghosts[to][from]);
    }
    if (now.count() == 10) hosts.overhead.packets.push_back({OverheadCommand::kRepeat, {}});
    if (now.count() == 30) hosts.overhead.packets.push_back({OverheadCommand::kStop, {}});
    whole.step(now, hosts.inputs(now));
    for (std::size_t to = 0; to < parts.size(); ++to) {
      std::vector<const RadioGhosts*> others;
      for (std::size_t from = 0; from < parts.size(); ++from) {
        if (from != to) others.push_back(&ghosts[to][from]);
      }
      RadioEngine::Inputs inputs = hosts.inputs(now);
      parts[to]->step(now, {inputs.swarm, inputs.overhead, others});
    }
    hosts.overhead.packets.clear();
    Seen all(kCrowd), split(kCrowd);
    RadioFrame frame;
    whole.emit(HostId{0}, frame);
    all.add(whole, frame);
    for (const auto& part : parts) {
      part->emit(HostId{0}, frame);
      split.add(*part, frame);
    }
    ASSERT_EQ(split.kilo_ticks, all.kilo_ticks) << now.count();
    ASSERT_EQ(split.ask, all.ask) << now.count();
    ASSERT_EQ(split.sent, all.sent) << now.count();
    ASSERT_EQ(split.receipts, all.receipts) << now.count();
    ASSERT_EQ(split.counters.collided, all.counters.collided) << now.count();
    ASSERT_EQ(split.counters.attempted, all.counters.attempted) << now.count();
    hosts.answer(now, HostId{0}, all.frame());
    for (std::uint32_t i = 0; i < kCrowd; ++i) {
      const bool was = hosts.poses[i].x_mm < 0;
      hosts.poses[i].x_mm += 8 * (draw(i, 1 + static_cast<int>(now.count()), 0) - 0.5);
      hosts.poses[i].y_mm += 8 * (draw(i, 1 + static_cast<int>(now.count()), 1) - 0.5);
      crossed += was != (hosts.poses[i].x_mm < 0);
    }
    hosts.place();
  }
  EXPECT_GT(crossed, 100u);
  EXPECT_GT(whole.counters().received, 10000u);
}

Region columns(double left_mm, double right_mm) {
  Region region;
  region.left_mm = left_mm;
  region.right_mm = right_mm;
  return region;
}

std::vector<Region> quarters() {
  std::vector<Region> all(4);
  for (std::size_t i = 0; i < 4; ++i) {
    (i % 2 == 0 ? all[i].right_mm : all[i].left_mm) = 0;
    (i < 2 ? all[i].top_mm : all[i].bottom_mm) = 0;
  }
  return all;
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();

INSTANTIATE_TEST_SUITE_P(
    Radio, Regions,
    ::testing::Combine(::testing::Values("radio { range_mm: 80 }", "radio { model: SIMPLE range_mm: 80 }",
                                         "radio { model: PROPAGATION range_mm: 80 propagation { notice_db: 0.5 "
                                         "body_loss_db: 0.5 power_sd_db: 0.5 sensitivity_sd_db: 0.5 } }"),
                       ::testing::Values(std::vector<Region>{columns(-kInfinity, 0), columns(0, kInfinity)},
                                         std::vector<Region>{columns(-kInfinity, -700), columns(-700, 650),
                                                             columns(650, kInfinity)},
                                         quarters())),
    [](const auto& tested) { return std::to_string(tested.index); });

}  // namespace
}  // namespace kilotwin::comm
