/// Plots of the report and their places on the page.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "clients/identify/report/report_plots.hpp"
#include "clients/report/html.hpp"

namespace kilotwin::identify::report {

/// Plots in page order. The page is composed before the plots are drawn.
class Figures {
 public:
  explicit Figures(Gnuplot& plots) : plots_(plots) {}
  Gnuplot& plots() { return plots_; }

  /// Adds a figure with one plot to a list for `figures.mustache`, if there is a plot.
  void place(html::Data& list, PlotNumber plot, const std::string& caption) {
    if (plot) add(list, {mark(*plot, caption)}, caption, false);
  }
  /// The same with two plots beside each other.
  void pair(html::Data& list, PlotNumber before, PlotNumber after, const std::string& caption) {
    std::vector<std::string> marks;
    if (before) marks.push_back(mark(*before, caption + ", before"));
    if (after) marks.push_back(mark(*after, caption + ", after"));
    if (!marks.empty()) add(list, marks, caption, true);
  }
  /// The page with all plots inserted.
  std::string filled(std::string page) const {
    const std::vector<Gnuplot::Drawn> drawn = plots_.draw();
    for (const auto& [number, alt] : alts_) {
      const std::string here = html::mark_of(number);
      const std::string shown =
          drawn[number].error.empty() ? html::image(drawn[number].svg, alt) : "This plot could not be drawn.";
      page.replace(page.find(here), here.size(), shown);
    }
    return page;
  }

 private:
  static void add(html::Data& list, const std::vector<std::string>& marks, const std::string& caption, bool pair) {
    html::Data plots{html::Data::type::list}, figure{html::Data::type::object};
    for (const std::string& one : marks) plots << html::Data{"plot", one};
    figure.set("plots", plots);
    if (!caption.empty()) figure.set("caption", caption);
    if (pair) figure.set("pair", html::Data{html::Data::type::bool_true});
    list << figure;
  }
  std::string mark(std::size_t number, const std::string& alt) {
    alts_.emplace(number, alt);
    return html::mark_of(number);
  }

  Gnuplot& plots_;
  std::map<std::size_t, std::string> alts_;
};

}  // namespace kilotwin::identify::report
