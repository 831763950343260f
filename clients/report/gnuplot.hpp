/// SVG plots drawn by gnuplot.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace kilotwin {

/// Plots that one gnuplot process draws.
class Gnuplot {
 public:
  /// Whether plots can be drawn on this machine.
  [[nodiscard]] static bool installed();
  /// Adds a plot of width x height px and returns its number. `commands` contain the data as data blocks.
  std::size_t add(int width_px, int height_px, std::string commands);
  struct Drawn {
    std::string svg;    ///< empty if the plot failed
    std::string error;  ///< the reason
  };
  /// One entry per plot. Throws RunError if gnuplot is missing.
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

/// A quoted gnuplot string. Commands and markup in it have no effect.
[[nodiscard]] std::string gnuplot_text(std::string_view text);

}  // namespace kilotwin
