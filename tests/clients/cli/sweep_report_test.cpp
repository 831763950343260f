#include "clients/cli/sweep_report.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "clients/recorder/summary.hpp"
#include "core/base/error.hpp"
#include "tests/clients/recorder/synthetic.hpp"

namespace kilotwin::cli {
namespace {

using recorder::Scratch;

constexpr std::int64_t kTicks = 62;

/// A run of a group of two robots and a group of one. Robot i moves by (0.5, 0.25 i) mm per tick.
std::filesystem::path run_of_two_groups(const Scratch& scratch, const std::string& name) {
  const std::filesystem::path run = scratch / name;
  std::filesystem::create_directory(run);
  proto::RecordingHeader header = recorder::synthetic_header(3);
  header.add_group_robots(2);
  header.add_group_robots(1);
  recorder::write_synthetic(run / "recording.ktrec", header, kTicks);
  recorder::Summary summary;
  summary.name = "synthetic";
  summary.robots = 3;
  summary.ticks = kTicks;
  recorder::write_summary(summary, run / "summary.json");
  return run;
}

SweepPlots displacement() {
  SweepPlots plots;
  plots.observable = recorder::Observable::kDisplacement;
  return plots;
}

TEST(SweepReport, ColoursByGroupAreTheGroupsAlone) {
  const Scratch scratch;
  SweepPlots plots = displacement();
  plots.colour_by = "group";
  SweepReport report("two", {{"f=1"}, {"f=2"}}, plots);
  report.add(0, 1, run_of_two_groups(scratch, "a"));
  report.add(1, 1, run_of_two_groups(scratch, "b"));
  const Plot curves = report.curves();
  ASSERT_EQ(curves.series.size(), 2u);
  const double t = kTicks;
  EXPECT_NEAR(curves.series[0].y.back(), t * (0.5 + std::hypot(0.5, 0.25)) / 2, 1e-9);
  EXPECT_NEAR(curves.series[1].y.back(), t * std::hypot(0.5, 0.5), 1e-9);
  EXPECT_NEAR(report.response().series.at(1).y.at(0), t * std::hypot(0.5, 0.5), 1e-9);
}

TEST(SweepReport, FailedRunsAreRowsAndNoResults) {
  const Scratch scratch;
  SweepReport report("two", {{"f=1"}, {"f=2"}}, displacement());
  report.add_failed(1, 5, scratch / "b", "it broke, \"badly\"");
  report.add(0, 5, run_of_two_groups(scratch, "a"));
  EXPECT_EQ(report.runs(), 1u);
  const std::string csv = report.runs_csv();
  const std::size_t second = csv.find('\n', csv.find('\n') + 1) + 1;
  EXPECT_NE(csv.find("/a,0,5,1,1,"), std::string::npos) << csv;
  EXPECT_NE(csv.substr(second).find("/b,1,5,0,2,,,,,,,,,,,,\"it broke, \"\"badly\"\"\""), std::string::npos) << csv;
  EXPECT_NE(report.table_csv().find("\nf=2,0,,"), std::string::npos) << report.table_csv();
}

TEST(SweepReport, AxesAreAsTheyAreAskedFor) {
  const Scratch scratch;
  const auto plotted = [&](const std::vector<SweepPoint>& points, AxisScale x, bool y_logarithmic) {
    SweepPlots plots = displacement();
    plots.x = x;
    plots.y_logarithmic = y_logarithmic;
    return SweepReport("axes", points, plots);
  };
  const std::vector<SweepPoint> even{{"f=1"}, {"f=2"}, {"f=3"}}, ratios{{"f=1"}, {"f=10"}, {"f=100"}};
  EXPECT_FALSE(plotted(even, AxisScale::kAutomatic, false).response().x_logarithmic);
  EXPECT_TRUE(plotted(even, AxisScale::kLogarithmic, false).response().x_logarithmic);
  EXPECT_TRUE(plotted(ratios, AxisScale::kAutomatic, false).response().x_logarithmic);
  EXPECT_FALSE(plotted(ratios, AxisScale::kLinear, false).response().x_logarithmic);
  for (const bool y : {false, true}) {
    EXPECT_EQ(plotted(even, AxisScale::kAutomatic, y).response().y_logarithmic, y);
    EXPECT_EQ(plotted(even, AxisScale::kAutomatic, y).curves().y_logarithmic, y);
  }
}

}  // namespace
}  // namespace kilotwin::cli
