#include "clients/identify/kilogrid/floor_plots.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "clients/identify/kilogrid/floor_groups.hpp"

namespace kilotwin::kilogrid {
namespace {

using identify::json_list, identify::json_value;

/// Residual speed of simulated runs over one covariate, mm/s.
identification::CovariatePlot plot_of(const char* name, const char* covariate, const char* unit,
                                      const std::vector<double>& at, const FloorTarget& target,
                                      const FloorStatistics& before, const FloorStatistics& after) {
  const StatisticGroup& group = statistic_group(name);
  identification::CovariatePlot plot;
  plot.set_target("forward");
  plot.set_covariate(covariate);
  plot.set_unit(unit);
  plot.set_acts_on_unit("mm/s");
  for (std::size_t i = 0; i < std::min(at.size(), group.size()); ++i) {
    const std::size_t s = group.first + i;
    const double measured = target.statistics().value[s];
    if (!std::isfinite(measured + before.value[s] + after.value[s])) continue;
    plot.add_at(at[i]);
    plot.add_before((measured - before.value[s]) / FloorBlocks::kBlock_s);
    plot.add_before_se(std::sqrt(target.statistics().variance[s]) / FloorBlocks::kBlock_s);
    plot.add_after((measured - after.value[s]) / FloorBlocks::kBlock_s);
  }
  return plot;
}

std::vector<double> middles(double first, double step, std::size_t count) {
  std::vector<double> at;
  for (std::size_t i = 0; i < count; ++i) at.push_back(first + step * static_cast<double>(i));
  return at;
}

identification::ResidualMap map_of(const FloorTarget& target, const FloorStatistics& before,
                                   const FloorStatistics& after) {
  const StatisticGroup& group = statistic_group("step-by-place");
  constexpr std::size_t kColumns = 4;
  const std::size_t rows = group.size() / kColumns;
  const double width = target.floor().width_mm / kColumns,
               height = target.floor().height_mm / static_cast<double>(rows);
  identification::ResidualMap map;
  map.set_target("forward");
  map.set_unit("mm/s");
  identify::assign(map.mutable_x_mm(), middles(0.5 * width - target.floor().width_mm / 2, width, kColumns));
  identify::assign(map.mutable_y_mm(), middles(0.5 * height - target.floor().height_mm / 2, height, rows));
  for (std::size_t r = 0; r < rows; ++r) {
    identify::JsonList &b = *map.add_before(), &a = *map.add_after();
    for (std::size_t c = 0; c < kColumns; ++c) {
      const std::size_t s = group.first + r * kColumns + c;
      const double measured = target.statistics().value[s];
      *b.add_values() = json_value((measured - before.value[s]) / FloorBlocks::kBlock_s);
      *a.add_values() = json_value((measured - after.value[s]) / FloorBlocks::kBlock_s);
    }
  }
  return map;
}

/// Shares as a histogram of 10 000 counts.
identification::Distribution distribution_of(const char* name, const char* title, const char* unit,
                                             const std::vector<double>& edges, const FloorTarget& target,
                                             const FloorStatistics& simulated) {
  const StatisticGroup& group = statistic_group(name);
  identification::Distribution d;
  d.set_name(title);
  d.set_unit(unit);
  identify::assign(d.mutable_edges(), edges);
  for (std::size_t s = group.first; s < group.first + group.size(); ++s) {
    d.add_measured(std::round(10000 * target.statistics().value[s]));
    d.add_simulated(std::round(10000 * simulated.value[s]));
  }
  return d;
}

}  // namespace

identify::JsonList numbers(const std::vector<double>& values, const StatisticGroup& group, bool root) {
  identify::JsonList list;
  for (std::size_t s = group.first; s < group.first + group.size(); ++s)
    *list.add_values() = json_value(root ? std::sqrt(values[s]) : values[s]);
  return list;
}

identification::Table table_of_motion(const FloorTarget& held_out, const FloorStatistics& before,
                                      const FloorStatistics& after) {
  identification::Table table;
  table.set_id("motion");
  table.set_title("Statistics of motion, measured and simulated");
  table.set_lead(
      "Held-out runs. All statistics use cell reports: mean positions in blocks of 10 s. A step below 16 mm counts "
      "as rest. Open floor: at least 150 mm from the walls.");
  identify::assign(table.mutable_head(), std::array{"", "measured", "base model", "with effects"});
  // One row of the table.
  const auto row = [&](const std::string& what, const char* format, const auto& read) {
    std::vector<std::string> cells{what};
    for (const std::vector<double>* values : {&held_out.statistics().value, &before.value, &after.value})
      cells.push_back(fmt::format(fmt::runtime(format), read(*values)));
    *table.add_rows() = json_list(cells);
  };
  const auto value = [&](const char* group, std::size_t i) {
    return [at = statistic_group(group).first + i](const std::vector<double>& v) { return v[at]; };
  };
  const auto share_of = [&](const char* group, std::size_t from, std::size_t to) {
    return [first = statistic_group(group).first, from, to](const std::vector<double>& v) {
      double sum = 0;
      for (std::size_t i = from; i < to; ++i) sum += v[first + i];
      return sum;
    };
  };
  for (std::size_t i = 0; i < groups::kLags_s.size(); ++i) {
    row(fmt::format("root mean square displacement in {} s, mm", groups::kLags_s[i]), "{:.0f}",
        [&, i](const auto& v) { return std::sqrt(value("msd", i)(v)); });
  }
  // Spread between robots about the common mean. The product of two half runs isolates the persistent part.
  const auto add_own = [&](const char* group, double about, double scale, const std::string& name,
                           const char* format) {
    const auto off = [=](const auto& v) { return value(group, 0)(v) - about; };
    row(name + ": mean", format, [=](const auto& v) { return value(group, 0)(v) * scale; });
    const auto variance = [=](const auto& v, std::size_t i) { return value(group, i)(v) - off(v) * off(v); };
    row(name + ": standard deviation between robots", format,
        [=](const auto& v) { return std::sqrt(std::max(variance(v, 1), 0.0)) * scale; });
    row(name + ": correlation between the halves of a run", "{:.2f}",
        [=](const auto& v) { return variance(v, 2) / variance(v, 1); });
  };
  constexpr double kPerSecond = 1 / FloorBlocks::kBlock_s;  // rate of blocks
  add_own("speed", groups::kAboutSpeed_mm, kPerSecond, "speed on the open floor, mm/s", "{:.2f}");
  add_own("turn-bias", 0, kPerSecond, "mean turn rate, rad/s", "{:+.4f}");
  row("rest on the open floor: episodes of 10 s or more per 1000 blocks", "{:.1f}", value("still-in-the-open", 0));
  row("... of 30 s or more", "{:.2f}", value("still-in-the-open", 2));
  row("rest beside walls: episodes of 10 s or more per 1000 blocks", "{:.0f}", value("still-beside-walls", 0));
  row("... of 40 s or more", "{:.1f}", value("still-beside-walls", 3));
  row("stays beside a wall of 200 s or more per 1000 blocks", "{:.2f}", value("stays-beside-walls", 5));
  row("share of time within 50 mm of a wall", "{:.3f}", value("occupancy", 0));
  row("share of time within 100 mm of a wall", "{:.3f}", share_of("occupancy", 0, 2));
  row("speed after 45 minutes, relative to the first 10", "{:.3f}", [&](const auto& v) {
    const auto of = share_of("step-by-time", 9, 11), at = share_of("step-by-time", 0, 2);
    return of(v) / at(v);
  });
  row("share of blocks of 10 s without a report", "{:.3f}", value("reports", 7));
  return table;
}

void add_plots(identification::Identification& out, const FloorTarget& held_out, const FloorStatistics& before,
               const FloorStatistics& after) {
  const StatisticGroup& ways = statistic_group("msd");
  identification::Msd& msd = *out.mutable_msd();
  for (std::size_t s = 0; s < ways.size(); ++s) msd.add_lag_s(groups::kLags_s[s]);
  *msd.mutable_measured_mm2() = numbers(held_out.statistics().value, ways, false);
  *msd.mutable_simulated_mm2() = numbers(after.value, ways, false);
  const double pi = 3.14159265358979;
  const auto add_plot = [&](const char* name, const char* covariate, const char* unit,
                            const std::vector<double>& at) {
    *out.add_covariate_plots() = plot_of(name, covariate, unit, at, held_out, before, after);
  };
  add_plot("step-by-time", "time", "s", middles(150, 300, 16));
  add_plot("step-by-wall", "position", "mm from the wall", {20, 45, 55, 67, 87, 125, 175, 250, 400});
  add_plot("step-by-neighbours", "neighbours", "within 100 mm", middles(0, 1, 5));
  add_plot("step-by-direction", "heading", "rad", middles(-7 * pi / 8, pi / 4, 8));
  *out.add_maps() = map_of(held_out, before, after);
  *out.add_distributions() =
      distribution_of("step", "displacement in 10 s", "mm",
                      {0, 8, 16, 24, 32, 40, 50, 60, 70, 80, 90, 100, 110, 120, 150, 200}, held_out, after);
  *out.add_distributions() =
      distribution_of("turn", "turn between displacements of 10 s", "rad", middles(0, pi / 8, 9), held_out, after);
}

}  // namespace kilotwin::kilogrid
