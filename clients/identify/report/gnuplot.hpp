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
  struct Drawn {
    std::string svg;    ///< empty where it could not be drawn
    std::string error;  ///< why
  };
  /// By number. Throws RunError where gnuplot is missing.
  [[nodiscard]] std::vector<Drawn> draw() const;
  [[nodiscard]] std::size_t size() const { return plots_.size(); }

 private:
  struct Plot {
    int width_px, height_px;
    std::string commands;
  };
  [[nodiscard]] std::string script(std::size_t plot, const std::string& file) const;

  std::vector<Plot> plots_;
};

/// A text for gnuplot, in quotes: nothing in it is taken as a command or as markup.
[[nodiscard]] std::string gnuplot_text(std::string_view text);

}  // namespace kilotwin::identify
