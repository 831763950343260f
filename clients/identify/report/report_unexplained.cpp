#include "clients/identify/report/report_unexplained.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "clients/report/html.hpp"

namespace kilotwin::identify::report {
namespace {

using html::escaped;

std::string comparisons(const json& u) {
  html::Table table({"compared with", "mm"});
  if (const auto expected = number(u, "expected_mm"); expected && *expected > 0)
    table.row({"what the model expects of itself", figure(expected)});
  if (const auto repeats = number(u, "repetitions_mm"))
    table.row({"what differs between repetitions of the same commands", figure(repeats)});
  const json& learner = part(u, "learner");
  if (const auto left = number(learner, "error_left_mm")) {
    table.row({fmt::format("what a random forest over all covariates leaves of {} mm{}",
                           figure(number(learner, "error_mm")),
                           part(learner, "cross_validated") == json(true) ? ", in cross-validation" : ""),
               figure(left)});
  }
  return table.text("facts");
}

std::string covariates_in_words(const json& pattern) {
  std::vector<std::string> names;
  for (const json& name : part(pattern, "covariates")) names.push_back(words_of(name.get<std::string>()));
  return fmt::format("{}", fmt::join(names, " and "));
}

/// Mean errors over the bins of one covariate: both components, one plot each.
std::string curve(const json& pattern, Figures& figures) {
  std::string out;
  for (const auto& [key, component] : {std::pair{"first_mm", 0U}, {"second_mm", 1U}}) {
    const json plot = {{"target", "error " + part(pattern, "components")[component].get<std::string>()},
                       {"covariate", part(pattern, "covariates")[0]},
                       {"unit", part(pattern, "units")[0]},
                       {"acts_on_unit", "mm"},
                       {"at", part(pattern, "at")},
                       {"before", part(pattern, key)[0]}};
    out += figures.place(plot_covariate(figures.plots(), plot), "");
  }
  return out;
}

/// Mean errors over two covariates, as two maps.
std::string map(const json& pattern, Figures& figures) {
  const auto of = [&](const char* key, std::size_t component) {
    const json map = {{"unit", "mm"},
                      {"at", part(pattern, "at")},
                      {"and_at", part(pattern, "and_at")},
                      {"covariates", part(pattern, "covariates")},
                      {"units", part(pattern, "units")},
                      {"value", part(pattern, key)}};
    return plot_table(figures.plots(), map, "error " + part(pattern, "components")[component].get<std::string>());
  };
  return figures.pair(of("first_mm", 0), of("second_mm", 1), "Mean error over " + covariates_in_words(pattern));
}

}  // namespace

std::string unexplained_body(const json& u, Figures& figures) {
  if (!u.is_object() || text(u, "in_words").empty()) return "";
  std::string out = comparisons(u), plots;
  for (const json& pattern : part(u, "patterns")) {
    if (!part(pattern, "covariates").is_array()) continue;
    plots += fmt::format("<p>By {}: {} of the mean square error.</p>\n", escaped(covariates_in_words(pattern)),
                         percent(number(pattern, "share")));
    plots += part(pattern, "covariates").size() == 1 ? "<div class=\"grid\">" + curve(pattern, figures) + "</div>\n"
                                                     : map(pattern, figures);
  }
  return out + plots;
}

}  // namespace kilotwin::identify::report
