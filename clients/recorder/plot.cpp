#include "clients/recorder/plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "clients/recorder/axis.hpp"
#include "core/os/files.hpp"
#include "clients/recorder/svg.hpp"
#include "core/base/error.hpp"

namespace kilotwin::recorder {
namespace {

constexpr double kWidth_px = 720, kHeight_px = 460, kMargin_px = 24, kTickText_px = 12, kTitleText_px = 13;

constexpr std::size_t kMostPoints = 40;

/// One axis: a range of values laid over a range of pixels.
struct Axis {
  double low = 0, high = 1;
  bool logarithmic = false;
  double from_px = 0, to_px = 1;
  AxisTicks ticks;

  [[nodiscard]] double position_px(double value) const {
    const double part = logarithmic ? std::log(value / low) / std::log(high / low) : (value - low) / (high - low);
    return from_px + std::clamp(part, -1.0, 2.0) * (to_px - from_px);
  }
};

struct Range {
  double low = std::numeric_limits<double>::infinity(), high = -std::numeric_limits<double>::infinity();
  void add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  [[nodiscard]] bool empty() const { return low > high; }
};

bool drawable(const PlotSeries& series, std::size_t i) {
  // Beyond these bounds differences of values could overflow.
  return std::abs(series.x[i]) < 1e150 && std::abs(series.y[i]) < 1e150;
}

double error_at(const PlotSeries& series, std::size_t i) {
  return i < series.error.size() && std::abs(series.error[i]) < 1e150 ? std::abs(series.error[i]) : 0;
}

/// The axis' range from that of the data: wide enough to have a length, from 0 where the data come near it.
Axis make_axis(Range data, bool logarithmic, bool towards_zero, double padding, int pieces) {
  Axis axis;
  axis.logarithmic = logarithmic && !data.empty() && data.low > 0;
  if (data.empty()) data = {0, 1};
  if (axis.logarithmic) {
    const double factor = std::max(std::pow(data.high / data.low, padding), 1.05);
    axis.low = data.low / factor;
    axis.high = data.high * factor;
    axis.ticks = logarithmic_ticks(axis.low, axis.high);
    if (axis.ticks.at.size() >= 2) return axis;
    axis.logarithmic = false;
  }
  if (towards_zero && data.low >= 0 && data.low <= 0.6 * data.high) data.low = 0;
  if (towards_zero && data.high <= 0 && data.high >= 0.6 * data.low) data.high = 0;
  double span = data.high - data.low;
  const double size = std::max(std::abs(data.low), std::abs(data.high));
  if (span <= 1e-12 * size || span == 0) {
    span = size > 0 ? 0.2 * size : 2;
    data.low -= span / 2;
    data.high += span / 2;
  }
  axis.low = data.low == 0 && towards_zero ? 0 : data.low - padding * span;
  axis.high = data.high == 0 && towards_zero ? 0 : data.high + padding * span;
  axis.ticks = linear_ticks(axis.low, axis.high, pieces);
  return axis;
}

std::string axis_title(const std::string& name, const std::string& unit, int exponent) {
  std::string scale = exponent == 0 ? "" : power_of_ten(exponent);
  if (!scale.empty() && !unit.empty()) scale += ' ';
  scale += unit;
  return scale.empty() ? name : fmt::format("{} ({})", name, scale);
}

std::string line(double x1, double y1, double x2, double y2, std::string_view colour, double width) {
  return fmt::format("<path d=\"M{:.1f} {:.1f}L{:.1f} {:.1f}\" stroke=\"{}\" stroke-width=\"{:g}\"/>\n", x1, y1, x2,
                     y2, colour, width);
}

std::string draw_series(const PlotSeries& series, const Axis& x, const Axis& y, std::string_view colour) {
  std::string path, bars, points, band_top, band_bottom;
  std::size_t drawn = 0;
  // Where the line would vanish under the points, it stands alone, and bars have no feet.
  const bool dense = series.line && series.x.size() > kMostPoints;
  for (std::size_t i = 0; i < series.x.size(); ++i) {
    const bool visible =
        drawable(series, i) && (!x.logarithmic || series.x[i] > 0) && (!y.logarithmic || series.y[i] > 0);
    if (!visible) continue;
    const double px = x.position_px(series.x[i]), py = y.position_px(series.y[i]);
    if (series.band) {
      const double error = error_at(series, i);
      const double low = y.logarithmic ? std::max(series.y[i] - error, y.low) : series.y[i] - error;
      band_top += fmt::format("{}{:.1f} {:.1f}", drawn == 0 ? "M" : "L", px, y.position_px(series.y[i] + error));
      band_bottom.insert(0, fmt::format("L{:.1f} {:.1f}", px, y.position_px(low)));
    }
    path += fmt::format("{}{:.1f} {:.1f}", drawn++ == 0 ? "M" : "L", px, py);
    if (const double error = error_at(series, i); error > 0) {
      const double low = y.logarithmic ? std::max(series.y[i] - error, y.low) : series.y[i] - error;
      const double top = y.position_px(series.y[i] + error), bottom = y.position_px(low);
      if (!series.band) bars += fmt::format("M{:.1f} {:.1f}V{:.1f}", px, top, bottom);
      if (!series.band && !dense) bars += fmt::format("M{0:.1f} {1:.1f}h8M{0:.1f} {2:.1f}h8", px - 4, top, bottom);
    }
    if (series.points && !dense) points += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3.6\"/>\n", px, py);
  }
  std::string out;
  if (series.band && drawn > 1)
    out += fmt::format("<path d=\"{}{}Z\" fill=\"{}\" fill-opacity=\"0.2\"/>\n", band_top, band_bottom, colour);
  if (series.line && drawn > 1) {
    out +=
        fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.8\" stroke-linejoin=\"round\"/>\n",
                    path, colour);
  }
  if (!bars.empty())
    out += fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.2\" stroke-opacity=\"{}\"/>\n",
                       bars, colour, dense ? 0.4 : 1);
  if (!points.empty()) {
    out += fmt::format("<g fill=\"{}\" stroke=\"{}\" stroke-width=\"1\">\n{}</g>\n", colour, svg::kPaper, points);
  }
  return out;
}

/// The legend's entries, row by row from the left; `top` moves below them.
std::string draw_legend(const Plot& plot, double left, double right, double& top) {
  if (plot.series.empty() || (plot.series.size() == 1 && plot.series[0].name.empty())) return {};
  std::string out;
  double at = left;
  for (std::size_t i = 0; i < plot.series.size(); ++i) {
    const std::string name = svg::shortened(plot.series[i].name, 40);
    const double width = 26 + svg::text_width_px(name, kTickText_px) + 16;
    if (at > left && at + width > right) {
      at = left;
      top += 18;
    }
    out += line(at, top - 4, at + 20, top - 4, svg::kPalette[i % svg::kPalette.size()], 3);
    out += svg::text(at + 26, top, kTickText_px, name);
    at += width;
  }
  top += 16;
  return out;
}

}  // namespace

std::string plot_svg(const Plot& plot) {
  Range x_data, y_data;
  for (const PlotSeries& series : plot.series) {
    KILOTWIN_DEMAND(series.x.size() == series.y.size());
    for (std::size_t i = 0; i < series.x.size(); ++i) {
      if (!drawable(series, i)) continue;
      x_data.add(series.x[i]);
      const double error = error_at(series, i);
      const bool bar_below = !plot.y_logarithmic || series.y[i] - error > 0;
      y_data.add(bar_below ? series.y[i] - error : series.y[i]);
      y_data.add(series.y[i] + error);
    }
  }
  Axis x = make_axis(x_data, plot.x_logarithmic, x_data.low == 0, 0.04, 8);
  Axis y = make_axis(y_data, plot.y_logarithmic, true, 0.06, 6);
  if (!plot.x_categories.empty()) {
    x.logarithmic = false;
    x.low = -0.5;
    x.high = static_cast<double>(plot.x_categories.size()) - 0.5;
    x.ticks = {};
    for (std::size_t i = 0; i < plot.x_categories.size(); ++i) {
      x.ticks.at.push_back(static_cast<double>(i));
      x.ticks.label.push_back(svg::shortened(plot.x_categories[i], 80 / plot.x_categories.size() + 3));
    }
  }

  double widest = 0;
  for (const std::string& label : y.ticks.label) widest = std::max(widest, svg::text_width_px(label, kTickText_px));
  const double left = kMargin_px + 22 + widest + 8, right = kWidth_px - kMargin_px;
  std::string body;
  double top = kMargin_px + 14;
  body += svg::text(left, top, 17, svg::shortened(plot.title, 64), svg::kInk, svg::Anchor::kStart, true);
  if (!plot.subtitle.empty())
    body += svg::text(left, top += 20, kTickText_px, svg::shortened(plot.subtitle, 100), svg::kFaint);
  top += 22;
  body += draw_legend(plot, left, right, top);
  const double bottom = kHeight_px - kMargin_px - 38;
  x.from_px = left;
  x.to_px = right;
  y.from_px = bottom;
  y.to_px = top;

  for (std::size_t i = 0; i < y.ticks.at.size(); ++i) {
    const double at = y.position_px(y.ticks.at[i]);
    body += line(left, at, right, at, y.ticks.at[i] == 0 ? svg::kFaint : svg::kLine, 1);
    body += svg::text(left - 8, at + 4, kTickText_px, y.ticks.label[i], svg::kInk, svg::Anchor::kEnd);
  }
  for (std::size_t i = 0; i < x.ticks.at.size(); ++i) {
    const double at = x.position_px(x.ticks.at[i]);
    body += line(at, bottom, at, bottom + 5, svg::kInk, 1);
    body += svg::text(at, bottom + 19, kTickText_px, x.ticks.label[i], svg::kInk, svg::Anchor::kMiddle);
  }
  body += line(left, bottom, right, bottom, svg::kInk, 1.2);
  body += line(left, top, left, bottom, svg::kInk, 1.2);
  body += svg::text((left + right) / 2, kHeight_px - kMargin_px + 4, kTitleText_px,
                    axis_title(plot.x_name, plot.x_unit, x.ticks.exponent), svg::kInk, svg::Anchor::kMiddle);
  body += fmt::format("<g transform=\"translate({:.1f} {:.1f}) rotate(-90)\">\n{}</g>\n", kMargin_px + 10,
                      (top + bottom) / 2,
                      svg::text(0, 0, kTitleText_px, axis_title(plot.y_name, plot.y_unit, y.ticks.exponent),
                                svg::kInk, svg::Anchor::kMiddle));
  for (std::size_t i = 0; i < plot.series.size(); ++i) {
    body += draw_series(plot.series[i], x, y, svg::kPalette[i % svg::kPalette.size()]);
  }
  if (x_data.empty())
    body += svg::text((left + right) / 2, (top + bottom) / 2, 14, "no data", svg::kFaint, svg::Anchor::kMiddle);
  return svg::document(kWidth_px, kHeight_px, plot.title,
                       fmt::format("{} against {}. {}", plot.y_name, plot.x_name, plot.subtitle), body);
}

void write_plot(const Plot& plot, const std::filesystem::path& file) { os::write_file(file, plot_svg(plot)); }

}  // namespace kilotwin::recorder
