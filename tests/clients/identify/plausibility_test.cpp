// Implausible data are reported with the remedy. Plausible data pass.
#include "clients/identify/data/plausibility.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>

#include "core/base/error.hpp"

namespace kilotwin::identify {
namespace {

/// Four robots that drive straight at 10 mm/s, two samples per second for 30 s.
MeasuredSet good() {
  MeasuredSet set;
  set.has_commands = set.has_headings = true;
  set.runs.push_back({"r", {}});
  for (std::uint32_t robot = 0; robot < 4; ++robot) {
    Track& track = set.runs[0].tracks.emplace_back();
    track.robot = robot;
    track.commands = {{-1e300, Motion::kStop}, {0, Motion::kStraight}};
    const double heading = 1.3 * robot - 2;
    for (double t = 0; t <= 30; t += 0.5)
      track.samples.push_back({t, 300.0 * robot + 10 * t * std::cos(heading), 10 * t * std::sin(heading), heading});
  }
  return set;
}

std::string complaint(const std::function<void(Sample&)>& change) {
  MeasuredSet set = good();
  for (Track& track : set.runs[0].tracks)
    for (Sample& s : track.samples) change(s);
  try {
    demand_plausible(set, "DIR");
  } catch (const UserError& error) {
    return error.what();
  }
  return "";
}

TEST(Plausible, GoodDataPass) {
  EXPECT_EQ(complaint([](Sample&) {}), "");
  // Headings that count beyond a full turn; sets without headings.
  EXPECT_EQ(complaint([](Sample& s) { s.heading_rad += 2 * M_PI * std::floor(s.time_s / 5); }), "");
  EXPECT_EQ(complaint([](Sample& s) { s.heading_rad = std::nan(""); }), "");
}

TEST(Plausible, WrongUnitsAreReported) {
  const auto says = [](const std::function<void(Sample&)>& change, const char* what) {
    const std::string text = complaint(change);
    EXPECT_NE(text.find(what), std::string::npos) << text;
    EXPECT_EQ(text.rfind("DIR: ", 0), 0U) << text;
    EXPECT_EQ(text.find('\n'), std::string::npos);
  };
  says([](Sample& s) { s.time_s += 1.7e9; }, "not since 1970");
  says([](Sample& s) { s.time_s *= 1000; }, "not milliseconds");
  says([](Sample& s) { s.x_mm /= 1000, s.y_mm /= 1000; }, "not metres");
  says([](Sample& s) { s.x_mm /= 300, s.y_mm /= 10; }, "not centimetres");
  says([](Sample& s) { s.x_mm *= 40, s.y_mm *= 40; }, "not pixels");
  says([](Sample& s) { s.x_mm = 1e300; }, "give mm");
  says([](Sample& s) { s.heading_rad = s.heading_rad * 180 / M_PI + 180; }, "not degrees");
  says([](Sample& s) { s.x_mm = 300 * std::round(s.x_mm / 300), s.y_mm = 0; }, "commanded robots drive");
}

TEST(Plausible, HeadingsThatAreNotThoseOfTheMotionAreReported) {
  const auto says = [](const std::function<void(Sample&)>& change, const char* what) {
    const std::string text = complaint(change);
    EXPECT_NE(text.find(what), std::string::npos) << text;
  };
  says([](Sample& s) { s.heading_rad = -s.heading_rad; }, "(their negatives)");
  says([](Sample& s) { s.heading_rad += M_PI / 2; }, "90 degrees to the left");
  says([](Sample& s) { s.heading_rad -= 2; }, "115 degrees to the right");
  // A marker that is turned a little, and headings that say nothing.
  EXPECT_EQ(complaint([](Sample& s) { s.heading_rad += 0.8; }), "");
  EXPECT_EQ(complaint([](Sample& s) { s.heading_rad = s.time_s * s.time_s; }), "");
}

TEST(Plausible, AxesOfAPictureAreReported) {
  MeasuredSet set = good();
  std::uint32_t left = 0;
  for (Track& track : set.runs[0].tracks) {
    const double turn = left++ % 2 == 0 ? 1 : -1;
    track.commands = {{-1e300, Motion::kStop}, {0, turn > 0 ? Motion::kLeft : Motion::kRight}};
    for (Sample& s : track.samples) {
      s.x_mm = 300.0 * track.robot + 30 * std::cos(0.4 * s.time_s);
      s.y_mm = turn * 30 * std::sin(0.4 * s.time_s);
    }
  }
  EXPECT_NO_THROW(demand_plausible(set, "DIR"));
  for (Track& track : set.runs[0].tracks)
    for (Sample& s : track.samples) s.y_mm = -s.y_mm;
  try {
    demand_plausible(set, "DIR");
    FAIL();
  } catch (const UserError& error) {
    EXPECT_NE(std::string(error.what()).find("--frame image"), std::string::npos) << error.what();
  }
}

TEST(Plausible, RobotNumbersThatNoModelFileTakesAreReported) {
  MeasuredSet set = good();
  set.runs[0].tracks.back().robot = 99'999;
  EXPECT_NO_THROW(demand_plausible(set, "DIR"));
  set.runs[0].tracks.back().robot = 100'000;
  EXPECT_THROW(demand_plausible(set, "DIR"), UserError);
}

TEST(Plausible, RecordingsInOneRunAreReported) {
  const std::string text = complaint([](Sample& s) { s.time_s += s.x_mm > 800 ? 3e5 : 0; });
  EXPECT_NE(text.find("give each recording a run of its own"), std::string::npos) << text;
}

TEST(Plausible, CommandsWithoutRobotsAreReported) {
  MeasuredSet set = good();
  for (Track& track : set.runs[0].tracks) track.commands = {{-1e300, Motion::kStop}};
  EXPECT_THROW(demand_plausible(set, "DIR"), UserError);
  // One moving robot suffices.
  set.runs[0].tracks[2].commands.push_back({20, Motion::kStraight});
  EXPECT_NO_THROW(demand_plausible(set, "DIR"));
}

TEST(Plausible, RunsShorterThanTheHorizonAreReported) {
  MeasuredSet set = good();
  EXPECT_NO_THROW(demand_longer_than(set, 30, false, "DIR"));
  EXPECT_THROW(demand_longer_than(set, 31, false, "DIR"), UserError);
  EXPECT_THROW(demand_longer_than(set, 10, true, "DIR"), UserError);
  set.runs[0].tracks[0].held_out = true;
  EXPECT_NO_THROW(demand_longer_than(set, 10, true, "DIR"));
}

}  // namespace
}  // namespace kilotwin::identify
