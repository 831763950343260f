#include "clients/identify/report/report_plots.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include "clients/identify/result/covariate_words.hpp"
#include "core/stats/quantiles.hpp"

namespace kilotwin::identify {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
// Larger values are no measurement and would break the axes.
constexpr double kAbsurd = 1e12;
constexpr int kHalf_px = 460, kLow_px = 280, kFlat_px = 210;

constexpr const char* kMeasuredAndModels =
    "plot $d using 1:2 with points pt 7 ps 0.7 lc rgb '#66727f' title 'measured', $d using 1:3 with lines lt 2 "
    "title "
    "'this model'";
constexpr const char* kBaseModel = ", $d using 1:4 with lines lt 5 title 'base model'";

double kept(double value) { return std::abs(value) < kAbsurd ? value : kNaN; }

std::vector<double> numbers(const google::protobuf::RepeatedField<double>& values) {
  std::vector<double> out;
  for (const double value : values) out.push_back(kept(value));
  return out;
}

std::vector<double> numbers(const google::protobuf::ListValue& list) {
  std::vector<double> out;
  for (const google::protobuf::Value& value : list.values())
    out.push_back(value.kind_case() == google::protobuf::Value::kNumberValue ? kept(value.number_value()) : kNaN);
  return out;
}

bool any_finite(const std::vector<double>& values) {
  return std::any_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

/// A gnuplot data block of columns of equal length. Values that are not finite are left empty.
std::string block(const char* name, const std::vector<std::vector<double>>& columns) {
  std::string out = fmt::format("${} << EOD\n", name);
  for (std::size_t row = 0; row < columns[0].size(); ++row) {
    for (const std::vector<double>& column : columns) {
      const double value = row < column.size() ? column[row] : kNaN;
      out += std::isfinite(value) ? fmt::format("{:.9g} ", value) : "NaN ";
    }
    out += '\n';
  }
  return out + "EOD\n";
}

std::string axis(const char* which, const std::string& name, const std::string& unit) {
  return fmt::format("set {}label {}\n", which,
                     gnuplot_text(unit.empty() ? words_of(name) : words_of(name) + ", " + unit));
}

using MapRows = google::protobuf::RepeatedPtrField<google::protobuf::ListValue>;

/// Values on a grid, [y][x].
struct Grid {
  std::vector<double> x, y;
  std::vector<std::vector<double>> value;

  template <typename Map>
  Grid(const Map& map, const MapRows& rows) : x(numbers(map.x_mm())), y(numbers(map.y_mm())) {
    for (const google::protobuf::ListValue& row : rows) value.push_back(numbers(row));
  }
  [[nodiscard]] bool good() const {
    if (x.size() < 2 || y.size() < 2 || value.size() != y.size()) return false;
    return std::all_of(value.begin(), value.end(), [&](const auto& row) { return row.size() == x.size(); });
  }
};

const MapRows& rows_of(const identification::ResidualMap& map, When when) {
  return when == When::kBefore ? map.before() : map.after();
}
const char* name_of(When when) { return when == When::kBefore ? "before" : "after"; }

/// The 98th percentile of the absolute values.
double reach(const std::vector<const MapRows*>& of) {
  std::vector<double> all;
  for (const MapRows* rows : of) {
    for (const google::protobuf::ListValue& row : *rows) {
      for (const double v : numbers(row)) {
        if (std::isfinite(v)) all.push_back(std::abs(v));
      }
    }
  }
  return stats::lower_quantile(all, 0.98);
}
double reach(const identification::ResidualMap& map) { return reach({&map.before(), &map.after()}); }

/// A round tick interval, about four per length.
double tick_step(double length) {
  const double rough = length / 4, power = std::pow(10, std::floor(std::log10(rough))), lead = rough / power;
  return power * (lead < 1.5 ? 1 : lead < 3.5 ? 2 : lead < 7.5 ? 5 : 10);
}

std::string map_frame(const Grid& grid) {
  const double half_x = 0.5 * (grid.x[1] - grid.x[0]), half_y = 0.5 * (grid.y[1] - grid.y[0]);
  const double step = tick_step(std::max(grid.x.back() - grid.x.front(), grid.y.back() - grid.y.front()));
  return fmt::format(
      "set size ratio -1\nset xrange [{}:{}]\nset yrange [{}:{}]\nset xlabel 'x, mm'\nset ylabel 'y, mm'\nunset "
      "grid\nunset key\nset tics front\nset xtics {}\nset ytics {}\n",
      grid.x.front() - half_x, grid.x.back() + half_x, grid.y.front() - half_y, grid.y.back() + half_y, step, step);
}

constexpr int kMap_px = 380, kMapHigh_px = 340;

/// x, y and value of the cells with a value.
std::vector<std::vector<double>> cells_of(const Grid& grid) {
  std::vector<std::vector<double>> columns(3);
  for (std::size_t row = 0; row < grid.y.size(); ++row) {
    for (std::size_t col = 0; col < grid.x.size(); ++col) {
      if (!std::isfinite(grid.value[row][col])) continue;
      columns[0].push_back(grid.x[col]);
      columns[1].push_back(grid.y[row]);
      columns[2].push_back(grid.value[row][col]);
    }
  }
  return columns;
}

std::string colours(const std::string& title, double most, const std::string& unit) {
  return fmt::format(
      "set title {}\nset cbrange [{}:{}]\nset palette defined (-1 '#2563a8', 0 '#f6f4ef', 1 '#d95f0e')\nset "
      "cblabel {} offset -0.5,0\n",
      gnuplot_text(title), -most, most, gnuplot_text(unit));
}

/// A grid in colours. `marks`: x and y of cells to mark.
PlotNumber coloured(Gnuplot& plots, const Grid& grid, double most, const std::string& title,
                    const std::string& unit, const std::vector<std::vector<double>>& marks = {}) {
  if (!grid.good() || !(most > 0)) return std::nullopt;
  const std::vector<std::vector<double>> columns = cells_of(grid);
  if (columns[0].empty()) return std::nullopt;
  // Slightly wider than the cells, to avoid gaps between them.
  const double half_x = 0.505 * (grid.x[1] - grid.x[0]), half_y = 0.505 * (grid.y[1] - grid.y[0]);
  std::string commands = block("d", columns) + map_frame(grid) + colours(title, most, unit);
  const bool marked = !marks.empty() && !marks[0].empty();
  if (marked) commands += block("m", marks);
  commands +=
      fmt::format("plot $d using 1:2:({}):({}):3 with boxxyerror fs solid 1 noborder fc palette", half_x, half_y);
  if (marked) commands += ", $m using 1:2 with points pt 2 ps 0.35 lw 0.8 lc rgb '#5a6673'";
  return plots.add(kMap_px, kMapHigh_px, commands);
}

/// Values over two covariates in colours.
PlotNumber plot_table(Gnuplot& plots, const identification::Pattern& pattern, const MapRows& rows,
                      const std::string& title) {
  const std::vector<double> at = numbers(pattern.at()), and_at = numbers(pattern.and_at());
  std::vector<std::vector<double>> columns(3);
  double most = 0;
  for (std::size_t row = 0; row < std::min(and_at.size(), static_cast<std::size_t>(rows.size())); ++row) {
    const std::vector<double> values = numbers(rows[static_cast<int>(row)]);
    for (std::size_t col = 0; col < std::min(at.size(), values.size()); ++col) {
      if (!std::isfinite(values[col])) continue;
      columns[0].push_back(static_cast<double>(col));
      columns[1].push_back(static_cast<double>(row));
      columns[2].push_back(values[col]);
      most = std::max(most, std::abs(values[col]));
    }
  }
  if (at.size() < 2 || and_at.size() < 2 || !(most > 0)) return std::nullopt;
  const auto tics = [](const char* which, const std::vector<double>& values) {
    std::string out = fmt::format("set {}tics (", which);
    const std::size_t every = 1 + values.size() / 6;
    for (std::size_t i = 0; i < values.size(); i += every)
      out += fmt::format("{}'{:.3g}' {}", i > 0 ? ", " : "", values[i], i);
    return out + ")\n";
  };
  std::string commands = block("d", columns) + tics("x", at) + tics("y", and_at);
  commands +=
      axis("x", pattern.covariates(0), pattern.units(0)) + axis("y", pattern.covariates(1), pattern.units(1));
  commands += fmt::format("unset grid\nunset key\nset xrange [-0.5:{}]\nset yrange [-0.5:{}]\n",
                          static_cast<double>(at.size()) - 0.5, static_cast<double>(and_at.size()) - 0.5);
  commands += colours(title, most, "mm");
  commands += "plot $d using 1:2:(0.505):(0.505):3 with boxxyerror fs solid 1 noborder fc palette";
  return plots.add(kMap_px, kMapHigh_px, commands);
}

}  // namespace

std::string words_of(const std::string& name) {
  static const std::map<std::string, std::string> kWords = {{"ahead", "residual ahead"},
                                                            {"WHEEL_GAIN", "change of speed"},
                                                            {"WHEEL_OFFSET", "change of speed"},
                                                            {"TURN_RATE", "turn rate"},
                                                            {"BODY_DRIFT", "drift"},
                                                            {"WORLD_DRIFT", "drift"},
                                                            {"MEASURED_OFFSET", "offset"},
                                                            {"MEASURED_BODY_OFFSET", "tracked point"},
                                                            {"MEASURED_SCALE", "camera scale"},
                                                            {"MEASURED_HEADING", "heading offset"},
                                                            {"nearest", "distance to the nearest robot"},
                                                            {"bearing", "direction to the nearest robot"},
                                                            {"left", "residual to the left"},
                                                            {"residual", "predicted position"},
                                                            {"residual_x", "residual along x"},
                                                            {"residual_y", "residual along y"},
                                                            {"driven_time", "driven time"},
                                                            {"straight", "share of straight driving"},
                                                            {"turning", "share of left minus right turns"},
                                                            {"radius", "distance from the centre"},
                                                            {"forward", "forward speed"},
                                                            {"sideways", "sideways slip"},
                                                            {"turn", "turn rate"},
                                                            {"world_x", "drift along x"},
                                                            {"world_y", "drift along y"},
                                                            {"measured_x", "measured position along x"},
                                                            {"measured_y", "measured position along y"},
                                                            {"measured", "measured position"},
                                                            {"world", "drift"}};
  const auto at = kWords.find(name);
  return at != kWords.end() ? at->second : covariate_in_words(name);
}

PlotNumber plot_horizon(Gnuplot& plots, const identification::Horizon& horizon) {
  const std::vector<double> at = numbers(horizon.at_s()), before = numbers(horizon.before_mm()),
                            after = numbers(horizon.after_mm()), floor = numbers(horizon.floor_mm());
  if (at.size() < 2 || !any_finite(before)) return std::nullopt;
  std::string commands = block("d", {at, before, after, floor});
  commands +=
      "set xlabel 'horizon, s'\nset ylabel 'rms error, mm'\nset xrange [0:*]\nset yrange [0:*]\nset "
      "key top left\n";
  commands +=
      "plot $d using 1:2 with linespoints lt 1 title 'before', $d using 1:3 with linespoints lt 2 title 'after'";
  if (any_finite(floor)) commands += ", $d using 1:4 with lines lt 3 title 'noise floor'";
  return plots.add(kHalf_px, kLow_px, commands);
}

PlotNumber plot_covariate(Gnuplot& plots, const identification::CovariatePlot& plot) {
  const std::vector<double> at = numbers(plot.at()), before = numbers(plot.before()),
                            se = numbers(plot.before_se()), after = numbers(plot.after());
  if (at.size() < 2 || !any_finite(before)) return std::nullopt;
  std::vector<double> low(at.size(), kNaN), high(at.size(), kNaN);
  for (std::size_t k = 0; k < std::min({at.size(), before.size(), se.size()}); ++k) {
    low[k] = before[k] - 2 * se[k];
    high[k] = before[k] + 2 * se[k];
  }
  std::string commands = block("d", {at, before, low, high, after});
  commands += axis("x", plot.covariate(), plot.unit()) + axis("y", plot.target(), plot.acts_on_unit());
  commands +=
      "set xzeroaxis lc rgb '#8896a4'\nset key bottom left horizontal opaque\nset offsets graph 0.02, graph 0.02, "
      "graph 0.12, graph 0.14\n";
  commands += "plot $d using 1:2:3:4 with yerrorbars lt 1 lw 1.2 dt solid ps 0.45 title 'before'";
  if (any_finite(after)) commands += ", $d using 1:5 with points lt 2 title 'after'";
  return plots.add(kHalf_px, kLow_px, commands);
}

PlotNumber plot_arrows(Gnuplot& plots, const identification::ResidualMap& map_x,
                       const identification::ResidualMap& map_y, When when) {
  const Grid x(map_x, rows_of(map_x, when)), y(map_y, rows_of(map_y, when));
  if (!x.good() || !y.good() || x.x != y.x || x.y != y.y) return std::nullopt;
  const double most = std::max(reach(map_x), reach(map_y));
  if (!(most > 0)) return std::nullopt;
  // The longest arrows span slightly more than a cell.
  const double scale = 1.1 * (x.x[1] - x.x[0]) / most;
  std::vector<std::vector<double>> columns(5);
  for (std::size_t row = 0; row < x.y.size(); ++row) {
    for (std::size_t col = 0; col < x.x.size(); ++col) {
      const double dx = x.value[row][col], dy = y.value[row][col];
      if (!std::isfinite(dx) || !std::isfinite(dy)) continue;
      const double length = std::hypot(dx, dy), cut = std::min(1.0, 1.5 * most / std::max(length, 1e-12));
      const double values[] = {x.x[col] - 0.5 * scale * cut * dx, x.y[row] - 0.5 * scale * cut * dy,
                               scale * cut * dx, scale * cut * dy, length};
      for (std::size_t k = 0; k < 5; ++k) columns[k].push_back(values[k]);
    }
  }
  if (columns[0].empty()) return std::nullopt;
  std::string commands = block("d", columns) + map_frame(x);
  commands += fmt::format(
      "set title {}\nset cbrange [0:{}]\nset palette defined (0 '#9fb6cc', 1 '#b3400a')\nset cblabel {} offset "
      "-0.5,0\n",
      gnuplot_text(name_of(when)), most, gnuplot_text(map_x.unit()));
  commands += "plot $d using 1:2:3:4:5 with vectors head filled size graph 0.018,20 lw 1.6 lc palette";
  return plots.add(kMap_px, kMapHigh_px, commands);
}

PlotNumber plot_map(Gnuplot& plots, const identification::ResidualMap& map, When when) {
  return coloured(plots, Grid(map, rows_of(map, when)), reach(map), name_of(when), map.unit());
}

PlotNumber plot_pattern(Gnuplot& plots, const identification::Pattern& pattern, Component component) {
  const int which = component == Component::kFirst ? 0 : 1;
  const MapRows& rows = which == 0 ? pattern.first_mm() : pattern.second_mm();
  if (which >= pattern.components_size() || rows.empty() || pattern.units_size() != pattern.covariates_size())
    return std::nullopt;
  const std::string title = "error " + pattern.components(which);
  if (pattern.covariates_size() != 1) return plot_table(plots, pattern, rows, title);
  identification::CovariatePlot plot;
  plot.set_target(title);
  plot.set_covariate(pattern.covariates(0));
  plot.set_unit(pattern.units(0));
  plot.set_acts_on_unit("mm");
  *plot.mutable_at() = pattern.at();
  for (const double mean : numbers(rows[0])) plot.add_before(mean);
  return plot_covariate(plots, plot);
}

PlotNumber plot_distribution(Gnuplot& plots, const identification::Distribution& distribution) {
  const std::vector<double> edges = numbers(distribution.edges()), measured = numbers(distribution.measured()),
                            simulated = numbers(distribution.simulated());
  if (edges.size() < 3 || measured.size() + 1 != edges.size() || simulated.size() != measured.size())
    return std::nullopt;
  const auto share = [](std::vector<double> counts) {
    double sum = 0;
    for (const double c : counts) sum += c;
    for (double& c : counts) c = sum > 0 ? 100 * c / sum : 0;
    return counts;
  };
  std::vector<double> middle, width;
  for (std::size_t k = 0; k + 1 < edges.size(); ++k) {
    middle.push_back(0.5 * (edges[k] + edges[k + 1]));
    width.push_back(edges[k + 1] - edges[k]);
  }
  const std::vector<double> base = numbers(distribution.base());
  std::string commands = block("d", {middle, share(measured), share(simulated), width, share(base)});
  commands += axis("x", distribution.name(), distribution.unit());
  commands += fmt::format("set ylabel 'share, %'\nset xrange [{}:{}]\nset yrange [0:*]\nset grid noxtics\n",
                          edges.front(), edges.back());
  commands += "plot $d using 1:2:4 with boxes fc rgb '#c3ccd5' fs solid 1 noborder title 'measured', ";
  if (base.size() == measured.size()) commands += "$d using 1:5 with histeps lt 5 title 'base model', ";
  commands += "$d using 1:3 with histeps lc rgb '#2563a8' lw 2 dt solid title 'this model'";
  return plots.add(kHalf_px, kLow_px, commands);
}

PlotNumber plot_msd(Gnuplot& plots, const identification::Msd& msd) {
  const std::vector<double> lag = numbers(msd.lag_s()), measured = numbers(msd.measured_mm2()),
                            simulated = numbers(msd.simulated_mm2());
  if (lag.size() < 2 || !any_finite(measured) || !any_finite(simulated)) return std::nullopt;
  const std::vector<double> base = numbers(msd.base_mm2());
  std::string commands = block("d", {lag, measured, simulated, base});
  commands +=
      "set logscale xy\nset format y '10^{%L}'\nset xlabel 'lag, s'\nset ylabel 'mean square displacement, "
      "mm²'\n";
  commands += kMeasuredAndModels;
  if (any_finite(base)) commands += kBaseModel;
  return plots.add(kHalf_px, kLow_px, commands);
}

PlotNumber plot_speed_over_time(Gnuplot& plots, const identification::SpeedOverTime& speeds) {
  const std::vector<double> at = numbers(speeds.time_s()), measured = numbers(speeds.measured_mm_s()),
                            simulated = numbers(speeds.simulated_mm_s()), base = numbers(speeds.base_mm_s());
  if (at.size() < 2 || !any_finite(measured) || !any_finite(simulated)) return std::nullopt;
  std::string commands = block("d", {at, measured, simulated, base});
  commands +=
      "set xlabel 'time in the run, s'\nset ylabel 'mean speed, mm/s'\nset offsets 0, 0, graph 0.1, graph 0.1\n";
  commands += kMeasuredAndModels;
  if (any_finite(base)) commands += kBaseModel;
  return plots.add(kHalf_px, kLow_px, commands);
}

PlotNumber plot_effect_map(Gnuplot& plots, const identification::EffectMap& map) {
  const Grid grid(map, map.effect()), low(map, map.low()), high(map, map.high());
  std::vector<std::vector<double>> marks(2);
  if (grid.good() && low.good() && high.good()) {
    // Every other cell, so that the colours stay visible.
    for (std::size_t row = 0; row < grid.y.size(); row += 2) {
      for (std::size_t col = 0; col < grid.x.size(); col += 2) {
        if (!(low.value[row][col] <= 0 && high.value[row][col] >= 0)) continue;
        marks[0].push_back(grid.x[col]);
        marks[1].push_back(grid.y[row]);
      }
    }
  }
  return coloured(plots, grid, reach({&map.effect()}), map.which() + words_of(map.acts_on()), map.unit(), marks);
}

PlotNumber plot_effect(Gnuplot& plots, const identification::EffectCurve& curve) {
  const std::vector<double> at = numbers(curve.at()), value = numbers(curve.value()), low = numbers(curve.low()),
                            high = numbers(curve.high());
  if (at.size() < 2 || value.size() != at.size() || !any_finite(value)) return std::nullopt;
  const bool band = low.size() == at.size() && high.size() == at.size() && any_finite(low) && any_finite(high);
  std::string commands = band ? block("d", {at, value, low, high}) : block("d", {at, value});
  commands += axis("x", curve.covariate(), curve.unit()) +
              fmt::format("set ylabel {}\n",
                          gnuplot_text(curve.which() + words_of(curve.acts_on()) + ", " + curve.acts_on_unit()));
  commands += "set xzeroaxis lc rgb '#8896a4'\nunset key\nset offsets 0, 0, graph 0.1, graph 0.1\n";
  commands += "plot ";
  if (band) commands += "$d using 1:3:4 with filledcurves fc rgb '#c9d8ea' fs solid 1 noborder, ";
  commands += "$d using 1:2 with lines lt 2";
  return plots.add(kHalf_px, kFlat_px, commands);
}

PlotNumber plot_steps(Gnuplot& plots, const google::protobuf::RepeatedPtrField<identification::Step>& steps,
                      double floor_mm) {
  std::string commands = "$d << EOD\n";
  double most = floor_mm;
  std::size_t count = 0;
  std::vector<std::string> added;
  for (const identification::Step& step : steps) {
    const double rmse = step.rmse_mm();
    if (!step.has_rmse_mm() || !std::isfinite(rmse)) continue;
    added.push_back(step.added());
    commands += fmt::format("{} {:.6g} {:.2f}\n", count++, rmse, rmse);
    most = std::max(most, rmse);
  }
  if (count < 2) return std::nullopt;
  commands +=
      "EOD\nunset key\nset ylabel 'rms error, mm'\nset boxwidth 0.6\nset grid noxtics\nset xtics rotate by 0 (";
  for (std::size_t k = 0; k < count; ++k) {
    commands += fmt::format("{}{} {}", k == 0 ? "" : ", ", gnuplot_text((k == 0 ? "" : "+ ") + added[k]), k);
  }
  commands +=
      fmt::format(")\nset xrange [-0.6:{}]\nset yrange [0:{}]\n", static_cast<double>(count) - 0.4, 1.15 * most);
  commands +=
      "plot $d using 1:2 with boxes fc rgb '#9fb6cc' fs solid 1 noborder, $d using 1:2:3 with labels offset 0,0.6 "
      "tc rgb '#1f2933'";
  if (std::isfinite(floor_mm)) commands += fmt::format(", {} with lines lt 3", floor_mm);
  return plots.add(count > 5 ? 2 * kHalf_px : kHalf_px, kLow_px, commands);
}

PlotNumber plot_robots(Gnuplot& plots, const google::protobuf::RepeatedPtrField<identification::Robot>& robots) {
  struct Row {
    std::string name;
    double before, after;
  };
  std::vector<Row> rows;
  for (const identification::Robot& robot : robots) {
    const Row row{std::to_string(robot.robot()), kept(robot.before_mm()), kept(robot.after_mm())};
    const bool known = robot.has_before_mm() && robot.has_after_mm();
    if (known && std::isfinite(row.before) && std::isfinite(row.after)) rows.push_back(row);
  }
  if (rows.size() < 2) return std::nullopt;
  std::stable_sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) { return a.before > b.before; });
  std::vector<std::vector<double>> columns(3);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    columns[0].push_back(static_cast<double>(k));
    columns[1].push_back(rows[k].before);
    columns[2].push_back(rows[k].after);
  }
  std::string commands = block("d", columns);
  commands += fmt::format(
      "set xlabel 'robot'\nset ylabel 'rms error, mm'\nset yrange [0:*]\nset xrange [-0.7:{}]\nset grid noxtics\n",
      static_cast<double>(rows.size()) - 0.3);
  if (rows.size() <= 60) {
    // labels side by side, even long ones
    commands += rows.size() <= 12 ? "set xtics (" : "set xtics font ',7' (";
    for (std::size_t k = 0; k < rows.size(); ++k)
      commands += fmt::format("{}{} {}", k == 0 ? "" : ", ", gnuplot_text(rows[k].name), k);
    commands += ")\n";
  } else {
    commands += "unset xtics\n";
  }
  commands +=
      "plot $d using 1:2:(0):($3-$2) with vectors nohead lw 1.2 lc rgb '#c8d0d9' notitle, "
      "$d using 1:2 with points lt 1 ps 0.7 title 'before', $d using 1:3 with points lt 2 ps 0.7 title 'after'";
  constexpr std::size_t kFew = 24;
  return plots.add(rows.size() <= kFew ? kHalf_px : 2 * kHalf_px, kLow_px, commands);
}

}  // namespace kilotwin::identify
