#include "clients/report/plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "clients/recorder/svg.hpp"
#include "core/base/error.hpp"
#include "core/os/files.hpp"

namespace kilotwin {
namespace {

using recorder::svg::kPalette;

constexpr double kText_px = 12;
/// Above this number of points, symbols would hide the line.
constexpr std::size_t kMostPoints = 40;
/// Values beyond these bounds are omitted; their differences could overflow.
constexpr double kLargest = 1e100, kSmallestLogarithmic = 1e-100;
constexpr std::size_t kLongestTitle = 64, kLongestSubtitle = 100, kLongestName = 40;

struct Range {
  double low = std::numeric_limits<double>::infinity(), high = -std::numeric_limits<double>::infinity();
  void add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  [[nodiscard]] bool empty() const { return low > high; }
};

bool drawable(const PlotSeries& series, std::size_t i) {
  return std::abs(series.x[i]) < kLargest && std::abs(series.y[i]) < kLargest;
}

double error_at(const PlotSeries& series, std::size_t i) {
  return i < series.error.size() && std::abs(series.error[i]) < kLargest ? std::abs(series.error[i]) : 0;
}

/// Range of the data, error bars included, and whether both axes can be logarithmic.
struct Extent {
  Range x, y, bars;
  explicit Extent(const Plot& plot) {
    for (const PlotSeries& series : plot.series) {
      KILOTWIN_DEMAND(series.x.size() == series.y.size());
      for (std::size_t i = 0; i < series.x.size(); ++i) {
        if (!drawable(series, i)) continue;
        x.add(series.x[i]);
        y.add(series.y[i]);
        bars.add(series.y[i] - error_at(series, i));
        bars.add(series.y[i] + error_at(series, i));
      }
    }
  }
};

/// `set xrange [...]`: never of length 0, and from 0 if the data come near it.
std::string range_command(char axis, Range data, bool logarithmic, bool towards_zero) {
  if (data.empty()) data = {0, 1};
  if (logarithmic) {
    const double factor = std::max(std::pow(data.high / data.low, 0.05), 1.05);
    return fmt::format("set logscale {0}\nset {0}range [{1:.10g}:{2:.10g}]\n", axis, data.low / factor,
                       data.high * factor);
  }
  if (towards_zero && data.low >= 0 && data.low <= 0.6 * data.high) data.low = 0;
  if (towards_zero && data.high <= 0 && data.high >= 0.6 * data.low) data.high = 0;
  double span = data.high - data.low;
  const double size = std::max(std::abs(data.low), std::abs(data.high));
  if (span <= 1e-6 * size || span < 1e-90) {
    span = size > 1e-90 ? 0.2 * size : 2;
    data.low -= span / 2;
    data.high += span / 2;
  }
  const double low = data.low == 0 && towards_zero ? 0 : data.low - 0.05 * span;
  const double high = data.high == 0 && towards_zero ? 0 : data.high + 0.05 * span;
  return fmt::format("set {}range [{:.10g}:{:.10g}]\n", axis, low, high);
}

std::string axis_title(const std::string& name, const std::string& unit) {
  return unit.empty() ? name : fmt::format("{} ({})", name, unit);
}

/// The data block $dN: x, y, low and high end of the bar.
std::string data_block(const PlotSeries& series, std::size_t number, const Extent& extent, bool x_logarithmic,
                       bool y_logarithmic) {
  std::string block = fmt::format("$d{} << EOD\n", number);
  for (std::size_t i = 0; i < series.x.size(); ++i) {
    const double x = series.x[i], y = series.y[i], error = error_at(series, i);
    if (!drawable(series, i) || (x_logarithmic && x <= 0) || (y_logarithmic && y <= 0)) {
      block += "\n";  // the line is interrupted
      continue;
    }
    const double low = y_logarithmic ? std::max(y - error, 0.5 * extent.y.low) : y - error;
    fmt::format_to(std::back_inserter(block), "{:.10g} {:.10g} {:.10g} {:.10g}\n", x, y, low, y + error);
  }
  return block + "EOD\n";
}

/// The elements of `plot` that draw one series; the first one appears in the legend.
std::vector<std::string> elements(const PlotSeries& series, std::size_t number, bool in_legend) {
  const std::string data = fmt::format("$d{}", number);
  const std::string colour = fmt::format("lc rgb '{}'", kPalette[number % kPalette.size()]);
  const std::string title =
      in_legend ? "title " + gnuplot_text(recorder::svg::shortened(series.name, kLongestName)) : "notitle";
  const bool dense = series.line && series.x.size() > kMostPoints;
  const bool errors =
      std::any_of(series.error.begin(), series.error.end(), [](double e) { return std::abs(e) > 0; });
  std::vector<std::string> out;
  if (series.band && errors)
    out.push_back(
        fmt::format("{} using 1:3:4 with filledcurves {} fs transparent solid 0.2 noborder notitle", data, colour));
  if (errors && !series.band)
    out.push_back(fmt::format("{} using 1:2:3:4 with yerrorbars pt 7 ps 0.05 lw 1.2 {} notitle", data, colour));
  const std::string_view style =
      series.line ? (series.points && !dense ? "linespoints pt 7 ps 0.6" : "lines") : "points pt 7 ps 0.6";
  out.push_back(fmt::format("{} using 1:2 with {} lw 1.8 {} {}", data, style, colour, title));
  return out;
}

std::string commands_of(const Plot& plot) {
  const Extent extent(plot);
  const auto logarithmic = [](bool wanted, const Range& data) {
    return wanted && !data.empty() && data.low > kSmallestLogarithmic;
  };
  const bool x_logarithmic = plot.x_categories.empty() && logarithmic(plot.x_logarithmic, extent.x);
  const bool y_logarithmic = logarithmic(plot.y_logarithmic, extent.y);
  const bool legend = plot.series.size() > 1 || (plot.series.size() == 1 && !plot.series[0].name.empty());

  const bool bare = plot.title.empty() && plot.subtitle.empty() && !legend;
  std::string out =
      fmt::format("set lmargin 11\nset rmargin 3\nset tmargin at screen {}\nset bmargin 4\nset format '%h'\n",
                  bare ? 0.95 : 0.79);
  out += fmt::format("set label 1 {} at screen 0.04,0.94 font ',17' textcolor rgb '{}'\n",
                     gnuplot_text(recorder::svg::shortened(plot.title, kLongestTitle)), recorder::svg::kInk);
  out +=
      fmt::format("set label 2 {} at screen 0.04,0.885 textcolor rgb '{}'\n",
                  gnuplot_text(recorder::svg::shortened(plot.subtitle, kLongestSubtitle)), recorder::svg::kFaint);
  if (legend) {
    // The title is a label beside the key: inside the key, gnuplot would give it a line of its own.
    const std::string title = plot.legend_title.empty() ? "" : plot.legend_title + ":";
    const double from = 0.03 + recorder::svg::text_width_px(title, kText_px) / plot.width_px;
    out += fmt::format("set label 3 {} at screen 0.04,0.83 textcolor rgb '{}'\n", gnuplot_text(title),
                       recorder::svg::kInk);
    out +=
        fmt::format("set key at screen {:.3f},0.85 left top Left reverse horizontal maxrows 1 samplen 2\n", from);
  } else {
    out += "unset key\n";
  }
  out += fmt::format("set xlabel {}\nset ylabel {}\n", gnuplot_text(axis_title(plot.x_name, plot.x_unit)),
                     gnuplot_text(axis_title(plot.y_name, plot.y_unit)));
  if (plot.x_categories.empty()) {
    out += range_command('x', extent.x, x_logarithmic, extent.x.low == 0);
  } else {
    std::string names;
    for (std::size_t i = 0; i < plot.x_categories.size(); ++i) {
      const std::string name = recorder::svg::shortened(plot.x_categories[i], 80 / plot.x_categories.size() + 3);
      names += fmt::format("{}{} {}", i == 0 ? "" : ", ", gnuplot_text(name), i);
    }
    out += fmt::format("set xrange [-0.5:{}-0.5]\nset xtics ({})\n", plot.x_categories.size(), names);
  }
  Range shown = extent.bars;
  if (y_logarithmic) shown.low = std::max(shown.low, 0.5 * extent.y.low);
  out += range_command('y', shown, y_logarithmic, true);

  if (extent.x.empty()) return out + "set label 4 'no data' at graph 0.5,0.5 center\nplot NaN notitle\n";
  std::vector<std::string> all;
  for (std::size_t i = 0; i < plot.series.size(); ++i) {
    out += data_block(plot.series[i], i, extent, x_logarithmic, y_logarithmic);
    for (std::string& element : elements(plot.series[i], i, legend)) all.push_back(std::move(element));
  }
  out += "plot ";
  for (std::size_t i = 0; i < all.size(); ++i) out += (i == 0 ? "" : ", \\\n  ") + all[i];
  return out + "\n";
}

}  // namespace

std::size_t add_plot(Gnuplot& plots, const Plot& plot) {
  return plots.add(plot.width_px, plot.height_px, commands_of(plot));
}

std::string plot_svg(const Plot& plot) {
  Gnuplot plots;
  add_plot(plots, plot);
  const Gnuplot::Drawn drawn = plots.draw().front();
  if (!drawn.error.empty()) throw RunError("gnuplot cannot draw a plot: " + drawn.error);
  return drawn.svg;
}

void write_plot(const Plot& plot, const std::filesystem::path& file) { os::write_file(file, plot_svg(plot)); }

}  // namespace kilotwin
