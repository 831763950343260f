#include "clients/report/plot.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/clients/recorder/synthetic.hpp"
#include "tests/clients/recorder/xml.hpp"

namespace kilotwin {
namespace {

using recorder::content;
using recorder::Element;
using recorder::Scratch;
using recorder::Xml;

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
       {"Spread", "5 seeds", "Time (s)", "MSD (mm\u00b2)", "noise", "no noise", "20", "200"}) {
    EXPECT_TRUE(xml.has_text(text)) << text;
  }
  // Points are copies of a symbol: six of the series, two of the legend.
  EXPECT_GE(std::count_if(xml.elements().begin(), xml.elements().end(),
                          [](const Element& e) {
                            return e.name == "use" && e.attribute("transform").find("translate(") == 0;
                          }),
            8);
}

TEST(Plot, DegenerateDataAreDrawn) {
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
}  // namespace kilotwin
