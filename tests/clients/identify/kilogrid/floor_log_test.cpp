// Reading Kilogrid logs: rows, faults of the data, errors with their place.
#include <gtest/gtest.h>

#include <filesystem>

#include "clients/identify/kilogrid/floor_log.hpp"
#include "core/base/error.hpp"

namespace kilotwin::kilogrid {
namespace {

const std::string kHeader = "time_s,robot,x_mm,y_mm\n";

std::string error_of(const std::string& text) {
  try {
    (void)parse_floor_run(text, "f.csv");
  } catch (const UserError& error) {
    return error.what();
  }
  return "";
}

/// A robot that stays in one cell, with a report every 2 s.
std::string still(std::uint32_t robot, double x_mm, double y_mm, int rows) {
  std::string text;
  for (int i = 0; i < rows; ++i)
    text += std::to_string(2 * i) + "," + std::to_string(robot) + "," + std::to_string(x_mm) + "," +
            std::to_string(y_mm) + "\n";
  return text;
}

TEST(FloorLog, RowsBecomeTracksOfRobots) {
  std::string rows;
  for (int i = 0; i < 100; ++i)
    rows += std::to_string(2 * i) + ",7,25,75\r\n" + std::to_string(2 * i) + ",3,975,1975\n";
  const FloorRun run = parse_floor_run(kHeader + rows, "f.csv");
  ASSERT_EQ(run.tracks.size(), 2u);
  EXPECT_EQ(run.tracks[0].robot, 3u);
  EXPECT_EQ(run.tracks[1].robot, 7u);
  EXPECT_EQ(run.tracks[1].size(), 100u);
  EXPECT_EQ(run.tracks[1].y_mm.back(), 75);
  EXPECT_EQ(run.duration_s, 198);
  EXPECT_TRUE(run.faults.empty());
}

TEST(FloorLog, ImplausibleRobotsAreReportedAndExcluded) {
  std::string rows;
  for (int i = 0; i < 200; ++i)
    rows +=
        std::to_string(2 * i) + ",1," + (i % 3 == 0 ? "925,1925" : "75,75") + "\n";  // two robots with one number
  const FloorRun two = parse_floor_run(kHeader + rows, "f.csv");
  ASSERT_EQ(two.faults.size(), 1u);
  EXPECT_TRUE(two.faults[0].reason.starts_with("in two places at once")) << two.faults[0].reason;
  EXPECT_TRUE(two.tracks.empty());
  const FloorRun seldom = parse_floor_run(kHeader + still(2, 75, 75, 20), "f.csv");
  ASSERT_EQ(seldom.faults.size(), 1u);
  EXPECT_EQ(seldom.faults[0].reason, "only 20 reports");
}

TEST(FloorLog, ASingleWrongRowIsRemoved) {
  std::string rows;
  for (int i = 0; i < 200; ++i) rows += std::to_string(2 * i) + ",1," + (i == 50 ? "925,1925" : "75,75") + "\n";
  const FloorRun run = parse_floor_run(kHeader + rows, "f.csv");
  ASSERT_EQ(run.tracks.size(), 1u);
  EXPECT_EQ(run.tracks[0].size(), 199u);
}

TEST(FloorLog, ErrorsNameFileAndLine) {
  EXPECT_EQ(error_of("a,b\n"),
            "f.csv:1:1: the columns time_s, robot, x_mm, y_mm are missing, the header has a, b; write "
            "time_s,robot,x_mm,y_mm");
  EXPECT_EQ(error_of(kHeader + "0,1,25,25\n1,1,25\n"), "f.csv:3:7: the row has 3 cells; the header names 4");
  EXPECT_EQ(error_of(kHeader + "0,1,25,25\n1,1,25,nan\n"), "f.csv:3:8: y_mm is \"nan\"; give a number");
  EXPECT_EQ(error_of(kHeader + "5,1,25,25\n4,1,25,25\n"),
            "f.csv:3:1: time_s is 4; the previous row is later; sort the rows by time");
  EXPECT_EQ(error_of(kHeader + "5,1,1025,25\n"), "f.csv:2:5: x_mm is 1025; on this floor x is within 0..1000 mm");
}

TEST(FloorLog, AnyTextGivesRunsOrAnError) {
  // Any mutation of a file gives runs or an error that names it.
  const std::string good = kHeader + still(4, 125, 525, 80);
  std::uint64_t state = 5;
  const auto below = [&](std::size_t n) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return static_cast<std::size_t>(state >> 33) % n;
  };
  for (int i = 0; i < 3000; ++i) {
    std::string text = good;
    for (std::size_t k = 0; k < 1 + below(3); ++k) {
      const std::size_t at = below(text.size());
      if (below(2) == 0)
        text.erase(at, 1 + below(30));
      else
        text.insert(at, 1 + below(4), "0,-.\n9eE\"x"[below(10)]);
    }
    const std::string error = error_of(text);
    EXPECT_TRUE(error.empty() || error.starts_with("f.csv:")) << error;
  }
}

TEST(FloorLog, TheMeasuredRunsAreRead) {
  const std::filesystem::path data = std::filesystem::path(KILOTWIN_SOURCES) / "../shared/data/kilogrid";
  if (!std::filesystem::exists(data))
    GTEST_SKIP() << "there is no " << data << ": the measured runs are not part of the project";
  ASSERT_TRUE(has_floor_runs(data));
  const std::vector<FloorRun> runs = read_floor_runs(data);
  ASSERT_EQ(runs.size(), 8u);
  std::size_t robots = 0, faults = 0;
  for (const FloorRun& run : runs) {
    robots += run.tracks.size();
    faults += run.faults.size();
  }
  EXPECT_GT(robots, 700u);
  // The first run has robots that share numbers.
  EXPECT_GE(runs[0].faults.size(), 5u);
  EXPECT_LT(faults, 20u);
}

}  // namespace
}  // namespace kilotwin::kilogrid
