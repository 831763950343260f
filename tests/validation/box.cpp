#include <fmt/format.h>

#include <cmath>

#include "clients/recorder/plot.hpp"
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
recorder::PlotSeries validate_formation(Runs& runs, Verdicts& verdicts, const std::string& engine,
                                        const Formation& formation, int last) {
  std::vector<std::string> words{"--set", "robots.count=1.." + std::to_string(last), "--set",
                                 "physics.engine=" + engine};
  words.insert(words.end(), formation.words.begin(), formation.words.end());
  const std::vector<Recorded> swept = runs.sweep(runs.source("experiments/box-push.txtpb"), words);
  recorder::PlotSeries series;
  series.name = engine + ", " + formation.name;
  for (std::size_t i = 0; i < swept.size(); ++i) {
    const Recorded& run = swept[i];
    const std::size_t end = run.time_s.size() - 1, middle = run.state_at(kDuration_s / 2);
    const auto moved = [&](std::size_t from, std::size_t to) {
      return std::hypot(run.movable_x_mm[to][0] - run.movable_x_mm[from][0],
                        run.movable_y_mm[to][0] - run.movable_y_mm[from][0]);
    };
    const std::string what = fmt::format("{}, {} {}", engine, i + 1, formation.name);
    series.x.push_back(static_cast<double>(i + 1));
    series.y.push_back(moved(0, end));
    if (i + 1 < 5) {
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
  const int last = effort.quick ? 6 : 8;
  recorder::Plot plot;
  plot.title = "How many robots it takes to push a box of 18 g";
  plot.subtitle = "way of the box in 40 s; robots drive at 10 mm/s";
  plot.x_name = "robots";
  plot.y_name = "way of the box";
  plot.y_unit = "mm";
  for (const char* engine : {"PLANAR", "ODE"}) {
    for (const Formation& formation : {abreast, in_file, three})
      plot.series.push_back(validate_formation(runs, verdicts, engine, formation, last));
  }
  if (!effort.plots.empty()) recorder::write_plot(plot, effort.plots / "validation-box.svg");
}

}  // namespace kilotwin::validation
