/// A plot of points with error bars, lines and bands, drawn by gnuplot as SVG.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "clients/report/gnuplot.hpp"

namespace kilotwin {

struct PlotSeries {
  std::string name;           ///< in the legend, which is omitted for one series without a name
  std::vector<double> x, y;   ///< of equal length; points that are not finite are omitted
  std::vector<double> error;  ///< half length of the bars; empty: none
  bool points = true;
  bool line = true;
  bool band = false;  ///< errors as a shaded band instead of bars
};

struct Plot {
  int width_px = 720, height_px = 460;
  std::string title;           ///< without title, subtitle and legend, the axes have their room
  std::string subtitle;        ///< small, below the title: meaning of the bars, number of runs
  std::string legend_title;    ///< common heading of the series' names
  std::string x_name, x_unit;  ///< unit "": none
  std::string y_name, y_unit;
  std::vector<std::string> x_categories;  ///< names of x = 0, 1, 2... if x is no number
  bool x_logarithmic = false;             ///< ignored if some x <= 0
  bool y_logarithmic = false;             ///< ignored if some y <= 0
  std::vector<PlotSeries> series;
};

/// Adds the plot to `plots` and returns its number.
std::size_t add_plot(Gnuplot& plots, const Plot& plot);

/// Throws RunError if gnuplot is missing.
[[nodiscard]] std::string plot_svg(const Plot& plot);

/// Throws RunError.
void write_plot(const Plot& plot, const std::filesystem::path& file);

}  // namespace kilotwin
