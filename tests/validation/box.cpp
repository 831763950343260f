#include <fmt/format.h>

#include <cmath>

#include "clients/report/plot.hpp"
#include "tests/validation/validations.hpp"

namespace kilotwin::validation {
namespace {

constexpr double kDuration_s = 40;
/// "By impact only": less than this in all that time.
constexpr double kStill_mm = 2;
/// "At nearly their own speed", 10 mm/s.
constexpr double kDriven_mm = 0.95 * 10 * kDuration_s;

struct Formation {
  const char* name;
  std::vector<std::string> words;
};

/// Adds rows and returns how far the box got, by number of robots.
PlotSeries validate_formation(Runs& runs, Verdicts& verdicts, const std::string& engine, const Formation& formation,
                              std::size_t first, std::size_t last) {
  std::vector<std::string> words{"--set", fmt::format("robots.count={}..{}", first, last), "--set",
                                 "physics.engine=" + engine};
  words.insert(words.end(), formation.words.begin(), formation.words.end());
  const std::vector<Recorded> swept = runs.sweep(runs.source("experiments/box-push.txtpb"), words);
  PlotSeries series;
  series.name = engine + ", " + formation.name;
  for (std::size_t i = 0; i < swept.size(); ++i) {
    const Recorded& run = swept[i];
    const std::size_t end = run.time_s.size() - 1, middle = run.state_at(kDuration_s / 2);
    const auto moved = [&](std::size_t from, std::size_t to) {
      return std::hypot(run.movable_x_mm[to][0] - run.movable_x_mm[from][0],
                        run.movable_y_mm[to][0] - run.movable_y_mm[from][0]);
    };
    const std::string what = fmt::format("{}, {} {}", engine, first + i, formation.name);
    const std::size_t robots = first + i;
    series.x.push_back(static_cast<double>(robots));
    series.y.push_back(moved(0, end));
    if (robots < 5) {
      verdicts.at_most(what, "mm", {moved(0, end)}, kStill_mm);
      verdicts.at_most(what + ": creep in the last 20 s", "mm", {moved(middle, end)}, 0.01);
    } else {
      verdicts.at_least(what, "mm", {moved(0, end)}, kDriven_mm);
    }
  }
  return series;
}

}  // namespace

void validate_box(Runs& runs, Verdicts& verdicts, Effort effort) {
  verdicts.section("way of a box of 18 g, pushed for 40 s: box-push.txtpb");
  const Formation abreast{"abreast", {}};
  const Formation in_file{"behind each other",
                          {"--set", "robots.layout.grid.columns=1", "--set", "robots.layout.grid.pitch_mm=33.5"}};
  const Formation three{"in three columns",
                        {"--set", "robots.layout.grid.columns=3", "--set", "robots.layout.grid.pitch_mm=33.5"}};
  Plot plot;
  plot.title = "How many robots it takes to push a box of 18 g";
  plot.subtitle = "way of the box in 40 s; robots drive at 10 mm/s";
  plot.x_name = "robots";
  plot.y_name = "way of the box";
  plot.y_unit = "mm";
  for (const std::string engine : {"PLANAR", "ODE"}) {
    // The threshold alone, where time is short.
    if (effort.quick && engine != "PLANAR") continue;
    if (!runs.accepts(runs.source("experiments/box-push.txtpb"), {"--set", "physics.engine=" + engine})) {
      verdicts.absent(engine, "this engine knows no movable bodies");
      continue;
    }
    for (const Formation& formation : {abreast, in_file, three})
      plot.series.push_back(
          validate_formation(runs, verdicts, engine, formation, effort.quick ? 4 : 1, effort.quick ? 5 : 8));
  }
  if (!effort.plots.empty()) write_plot(plot, effort.plots / "validation-box.svg");
}

}  // namespace kilotwin::validation
