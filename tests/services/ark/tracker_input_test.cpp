#include "services/ark/tracker_input.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <random>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/scenes.hpp"

namespace kilotwin::ark {
namespace {

constexpr std::uint32_t kRobots = 4;

/// A tracker's sample in columns of its own, as an outsider writes it.
struct Columns {
  std::string source = "ceiling";
  std::uint64_t frame = 1;
  std::int64_t capture_ns = 1'000'000;
  std::vector<std::uint32_t> robot{0};
  std::vector<std::uint8_t> state{0}, led{255};
  std::vector<double> x{100}, y{-50}, heading{0.5};
  std::vector<float> xx{0.04f}, xy{0}, yy{0.04f}, heading_variance{0.001f};
  std::vector<float> vx{}, vy{};
};

template <class Sequence, class Value> void point(Sequence& sequence, std::vector<Value>& values) {
  sequence._buffer = values.data();
  sequence._length = sequence._maximum = static_cast<std::uint32_t>(values.size());
}

PublicTrackerFrame sample_of(Columns& from) {
  PublicTrackerFrame sample{};
  std::strncpy(sample.source, from.source.c_str(), sizeof(sample.source) - 1);
  sample.frame = from.frame;
  sample.capture_ns = from.capture_ns;
  point(sample.robot, from.robot);
  point(sample.state, from.state);
  point(sample.led, from.led);
  point(sample.x_mm, from.x);
  point(sample.y_mm, from.y);
  point(sample.heading_rad, from.heading);
  point(sample.xx_mm2, from.xx);
  point(sample.xy_mm2, from.xy);
  point(sample.yy_mm2, from.yy);
  point(sample.heading_variance_rad2, from.heading_variance);
  point(sample.vx_mm_s, from.vx);
  point(sample.vy_mm_s, from.vy);
  return sample;
}

class TrackerInputs : public ::testing::Test {
 protected:
  void write(Columns columns) { writer_.write(sample_of(columns)); }
  /// All samples up to the one of the source "last", which the call writes until it has arrived.
  std::vector<TrackerInput::Stamped> take_all() {
    const auto deadline = TrackerInput::Clock::now() + std::chrono::seconds(60);
    std::vector<TrackerInput::Stamped> all;
    Columns last;
    last.source = "last";
    for (bool seen = false; !seen && TrackerInput::Clock::now() < deadline; ++last.frame) {
      last.capture_ns += 1'000'000;
      write(last);
      std::this_thread::yield();
      for (TrackerInput::Stamped& stamped : input_.take(TrackerInput::Clock::now(), 0, 1)) all.push_back(stamped);
      for (const TrackerReport& report : input_.report()) seen = seen || report.source == "last";
    }
    return all;
  }

  const RunPlan plan_ = testing::make_plan("robots { count: 4 body: TRACKED }",
                                           testing::grid_crowd(kRobots, 100, testing::Facing::kRight));
  const dds::DomainClaim claim_ = dds::DomainClaim::any();
  const dds::Participant participant_{{claim_.domain(), {}}};
  TrackerInput input_{plan_, participant_};
  dds::Writer<PublicTrackerFrame> writer_{participant_, topics::tracker_frames()};
};

TEST_F(TrackerInputs, OfSourcesThatTheExperimentDoesNotNameAreNumberedByTheirArrival) {
  for (const char* const source : {"ceiling", "wall", "ceiling"}) {
    Columns columns;
    columns.source = source;
    write(columns);
    static_cast<void>(take_all());
  }
  std::vector<std::string> names;
  for (const TrackerReport& report : input_.report()) names.push_back(report.source);
  EXPECT_EQ(names, (std::vector<std::string>{"ceiling", "last", "wall"}));
}

TEST_F(TrackerInputs, KeepOnlyEntriesThatCanBeUsed) {
  Columns columns;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  columns.robot = {1, 1, kRobots, 2, 3};  // twice the same, unknown, without place, without heading
  columns.state = {0, 0, 0, 0, 0};
  columns.led = {64, 0, 0, 0, 5};
  columns.x = {10, 20, 30, nan, 40};
  columns.y = {1, 2, 3, 4, 5};
  columns.heading = {0, 0, 0, 0, nan};
  columns.xx = columns.xy = columns.yy = {1, 1, 1, 1, 1};
  columns.heading_variance = {0.5f, 1, 1, 1, 1};
  write(columns);
  std::vector<TrackerInput::Stamped> taken = take_all();
  ASSERT_FALSE(taken.empty());
  const TrackerSample& sample = taken.front().sample;
  EXPECT_EQ(sample.robot, (std::vector<std::uint32_t>{1, 3}));
  EXPECT_EQ(sample.x, (std::vector<float>{10, 40}));
  EXPECT_EQ(sample.led, (std::vector<std::uint8_t>{kUnknownLed, 5}));
  EXPECT_EQ(sample.heading_variance_rad2[0], 0.5f);
  EXPECT_TRUE(std::isinf(sample.heading_variance_rad2[1])) << "a heading that is no number is not known";
}

TEST_F(TrackerInputs, VelocitiesMayBeLeftOutButNotHalfOfThem) {
  Columns columns;
  columns.vx = columns.vy = {1};
  write(columns);
  columns.vy.clear();
  columns.frame = 2;
  write(columns);
  columns.vy = {1, 2};
  columns.frame = 3;
  write(columns);
  std::set<std::uint64_t> frames;
  for (const TrackerInput::Stamped& taken : take_all()) {
    if (taken.sample.source == 0) frames.insert(taken.sample.frame);
  }
  EXPECT_EQ(frames, (std::set<std::uint64_t>{1}));
}

/// Samples of any content leave the station running, and those that it takes are usable.
TEST_F(TrackerInputs, OfAnyContentAreSurvived) {
  std::mt19937_64 random(5);
  const auto below = [&](std::uint64_t limit) { return random() % limit; };
  const std::vector<double> odd{0,   -0.0,   1e300, -1e300, 1e9, std::numeric_limits<double>::infinity(),
                                NAN, 1e-310, 250};
  const auto value = [&] { return odd[below(odd.size())]; };
  for (int k = 0; k < 2000; ++k) {
    Columns columns;
    columns.source = "source " + std::to_string(below(40));
    columns.frame = below(8) == 0 ? random() : static_cast<std::uint64_t>(k);
    columns.capture_ns = below(4) == 0 ? static_cast<std::int64_t>(random()) : k * 1'000'000;
    const std::size_t n = below(6);
    const auto length = [&] { return below(16) == 0 ? below(9) : n; };
    const auto fill = [&](auto& column, auto draw) {
      column.clear();
      for (std::size_t i = length(); i > 0; --i) column.push_back(draw());
    };
    if (below(4) == 0) {
      for (auto* column : {&columns.vx, &columns.vy}) fill(*column, [&] { return static_cast<float>(value()); });
    }
    fill(columns.robot, [&] { return static_cast<std::uint32_t>(below(10) == 0 ? random() : below(6)); });
    fill(columns.state, [&] { return static_cast<std::uint8_t>(below(6)); });
    fill(columns.led, [&] { return static_cast<std::uint8_t>(random()); });
    for (auto* column : {&columns.x, &columns.y, &columns.heading}) fill(*column, value);
    for (auto* column : {&columns.xx, &columns.xy, &columns.yy, &columns.heading_variance})
      fill(*column, [&] { return static_cast<float>(value()); });
    write(columns);
    if (k % 50 != 0) continue;
    for (const TrackerInput::Stamped& taken : input_.take(TrackerInput::Clock::now(), k, 1)) {
      const TrackerSample& sample = taken.sample;
      EXPECT_EQ(std::set(sample.robot.begin(), sample.robot.end()).size(), sample.robot.size());
      for (std::size_t i = 0; i < sample.robot.size(); ++i) {
        EXPECT_LT(sample.robot[i], kRobots);
        EXPECT_TRUE(std::isfinite(sample.x[i]) && std::isfinite(sample.y[i]) &&
                    std::isfinite(sample.heading_rad[i]));
        EXPECT_TRUE(std::isfinite(sample.xx[i]) && std::isfinite(sample.xy[i]) && std::isfinite(sample.yy[i]));
        EXPECT_GE(sample.heading_variance_rad2[i], 0);
      }
    }
  }
  EXPECT_LE(input_.report().size(), 16u);
}

}  // namespace
}  // namespace kilotwin::ark
