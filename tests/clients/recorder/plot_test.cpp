#include "clients/recorder/plot.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "clients/recorder/axis.hpp"
#include "tests/clients/recorder/synthetic.hpp"
#include "tests/clients/recorder/xml.hpp"

namespace kilotwin::recorder {
namespace {

using Labels = std::vector<std::string>;

TEST(Axis, RoundSteps) {
  EXPECT_DOUBLE_EQ(round_step(10, 5), 2);
  EXPECT_DOUBLE_EQ(round_step(10, 10), 1);
  EXPECT_DOUBLE_EQ(round_step(11, 5), 5);
  EXPECT_DOUBLE_EQ(round_step(0.7, 7), 0.1);
  EXPECT_DOUBLE_EQ(round_step(6e6, 6), 1e6);
}

TEST(Axis, LinearTicks) {
  EXPECT_EQ(linear_ticks(0, 60, 6).label, (Labels{"0", "10", "20", "30", "40", "50", "60"}));
  EXPECT_EQ(linear_ticks(-0.31, 0.52, 5).label, (Labels{"-0.2", "0.0", "0.2", "0.4"}));
  EXPECT_EQ(linear_ticks(99.5, 100.5, 4).label, (Labels{"99.5", "100.0", "100.5"}));
  const AxisTicks large = linear_ticks(0, 250'000, 5);
  EXPECT_EQ(large.exponent, 3);
  EXPECT_EQ(large.label, (Labels{"0", "50", "100", "150", "200", "250"}));
  EXPECT_EQ(large.at.back(), 250'000);
  const AxisTicks small = linear_ticks(0, 0.004, 4);
  EXPECT_EQ(small.exponent, -3);
  EXPECT_EQ(small.label, (Labels{"0", "1", "2", "3", "4"}));
}

TEST(Axis, LogarithmicTicks) {
  EXPECT_EQ(logarithmic_ticks(0.8, 110).label, (Labels{"1", "2", "5", "10", "20", "50", "100"}));
  const AxisTicks wide = logarithmic_ticks(1e-6, 1e6);
  EXPECT_LE(wide.at.size(), 13u);
  EXPECT_EQ(wide.label.front(), "10\u207b\u2076");
}

TEST(Plot, HasTitlesUnitsTicksBarsAndLegend) {
  Plot plot;
  plot.title = "Spread";
  plot.subtitle = "5 seeds";
  plot.x_name = "Time";
  plot.x_unit = "s";
  plot.y_name = "MSD";
  plot.y_unit = "mm\u00b2";
  plot.series.push_back({"noise", {0, 10, 20}, {0, 120'000, 230'000}, {0, 5'000, 9'000}});
  plot.series.push_back({"no noise", {0, 10, 20}, {0, 10'000, 20'000}, {}});
  const Xml xml(plot_svg(plot));
  ASSERT_FALSE(xml.elements().empty());
  for (const char* const text :
       {"Spread", "5 seeds", "Time (s)", "MSD (10\u00b3 mm\u00b2)", "noise", "no noise", "20", "200"}) {
    EXPECT_TRUE(xml.has_text(text)) << text;
  }
  EXPECT_EQ(std::count_if(xml.elements().begin(), xml.elements().end(),
                          [](const Element& e) { return e.name == "circle"; }),
            6);
}

TEST(Plot, OddDataAreDrawnToo) {
  const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
  const std::vector<std::pair<std::vector<double>, std::vector<double>>> cases{{{}, {}},
                                                                               {{1}, {5}},
                                                                               {{1, 2}, {5, 5}},
                                                                               {{1, 1}, {0, 0}},
                                                                               {{1, nan, 3}, {2, 3, infinity}},
                                                                               {{-1, 0, 1e100}, {-1e-100, 0, 1}},
                                                                               {{1e-300, 2e-300}, {1e149, -1e149}}};
  for (const auto& [x, y] : cases) {
    for (const bool logarithmic : {false, true}) {
      Plot plot;
      plot.title = "t";
      plot.x_logarithmic = plot.y_logarithmic = logarithmic;
      plot.series.push_back({"", x, y, std::vector<double>(x.size(), 0.5)});
      const std::string svg = plot_svg(plot);
      EXPECT_FALSE(Xml(svg).elements().empty());
      EXPECT_EQ(svg.find("nan"), std::string::npos);
      EXPECT_EQ(svg.find("inf"), std::string::npos);
    }
  }
  EXPECT_TRUE(Xml(plot_svg(Plot{})).has_text("no data"));
}

TEST(Plot, CategoriesHaveTheirNames) {
  Plot plot;
  plot.x_categories = {"disperse.c", "orbit.c"};
  plot.series.push_back({"", {0, 1}, {3, 4}, {1, 1}, true, false});
  const Scratch scratch;
  write_plot(plot, scratch / "p.svg");
  const Xml xml(content(scratch / "p.svg"));
  EXPECT_TRUE(xml.has_text("disperse.c"));
  EXPECT_TRUE(xml.has_text("orbit.c"));
}

}  // namespace
}  // namespace kilotwin::recorder
