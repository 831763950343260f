/// Plots of the report and their places on the page.
#pragma once

#include <fmt/format.h>

#include <map>
#include <string>
#include <vector>

#include "clients/identify/report/report_plots.hpp"
#include "clients/report/html.hpp"

namespace kilotwin::identify::report {

/// Plots in page order. The page is composed before the plots are drawn.
class Figures {
 public:
  explicit Figures(Gnuplot& plots) : plots_(plots) {}
  Gnuplot& plots() { return plots_; }

  /// Markup for a plot; empty if there is none.
  std::string place(PlotNumber number, const std::string& caption, const char* kind = "") {
    if (!number) return "";
    return fmt::format("<figure{}>{}{}</figure>\n", *kind == 0 ? "" : fmt::format(" class=\"{}\"", kind),
                       mark(*number, caption),
                       caption.empty() ? "" : "<figcaption>" + html::escaped(caption) + "</figcaption>");
  }
  std::string pair(PlotNumber before, PlotNumber after, const std::string& caption) {
    if (!before && !after) return "";
    std::string out = "<figure class=\"pair\">";
    if (before) out += mark(*before, caption + ", before");
    if (after) out += mark(*after, caption + ", after");
    return out + "<figcaption>" + html::escaped(caption) + "</figcaption></figure>\n";
  }
  /// The page with all plots inserted.
  std::string filled(std::string page) const {
    const std::vector<Gnuplot::Drawn> drawn = plots_.draw();
    for (const auto& [number, alt] : alts_) {
      const std::string here = html::mark_of(number);
      const std::string shown = drawn[number].error.empty() ? html::image(drawn[number].svg, alt)
                                                            : "<p>This plot could not be drawn.</p>";
      page.replace(page.find(here), here.size(), shown);
    }
    return page;
  }

 private:
  std::string mark(std::size_t number, const std::string& alt) {
    alts_.emplace(number, alt);
    return html::mark_of(number);
  }

  Gnuplot& plots_;
  std::map<std::size_t, std::string> alts_;
};

/// The sections of the page, in its order. Those without a body are left out.
class Sections {
 public:
  /// `lead` and `body` are markup.
  void add(const std::string& id, const std::string& title, const std::string& lead, const std::string& body) {
    if (body.empty()) return;
    html::Data section{html::Data::type::object};
    section.set("id", id);
    section.set("title", title);
    if (!lead.empty()) section.set("lead", lead);
    section.set("body", body);
    all_ << section;
  }
  [[nodiscard]] const html::Data& all() const { return all_; }

 private:
  html::Data all_{html::Data::type::list};
};

}  // namespace kilotwin::identify::report
