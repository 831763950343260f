/// Plots by gnuplot, as SVG.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace kilotwin::identify {

/// Plots that are drawn together, by one process.
class Gnuplot {
 public:
  /// Adds a plot of `commands`, width x height px; returns its number. Data go into the commands as data blocks.
  std::size_t add(int width_px, int height_px, std::string commands);
  /// One SVG document per plot, by number. Throws RunError where gnuplot is missing or fails.
  [[nodiscard]] std::vector<std::string> draw() const;
  [[nodiscard]] std::size_t size() const { return plots_.size(); }

 private:
  struct Plot {
    int width_px, height_px;
    std::string commands;
  };
  std::vector<Plot> plots_;
};

/// A text for gnuplot, in quotes: nothing in it is taken as a command or as markup.
[[nodiscard]] std::string gnuplot_text(std::string_view text);

}  // namespace kilotwin::identify
