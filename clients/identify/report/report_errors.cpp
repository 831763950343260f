#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "clients/identify/report/report_sections.hpp"
#include "clients/identify/report/report_summary.hpp"

namespace kilotwin::identify::report {
namespace {

using identification::Pattern, identification::ResidualMap, identification::Simulated, identification::Unexplained;
using Rows = std::vector<std::vector<std::string>>;

std::string covariates_in_words(const Pattern& pattern) {
  std::vector<std::string> names;
  for (const std::string& name : pattern.covariates()) names.push_back(words_of(name));
  return fmt::format("{}", fmt::join(names, " and "));
}

std::string compared(const Unexplained& u) {
  Rows rows;
  if (u.expected_mm() > 0) rows.push_back({"what the model expects of itself", figure(u.expected_mm())});
  if (const auto repeats = number(u.repetitions_mm()))
    rows.push_back({"what differs between repetitions of the same commands", figure(repeats)});
  if (u.has_learner()) {
    rows.push_back(
        {fmt::format("what a random forest over all covariates leaves of {} mm{}", figure(u.learner().error_mm()),
                     u.learner().cross_validated() ? ", in cross-validation" : ""),
         figure(u.learner().error_left_mm())});
  }
  return table_of({"compared with", "mm"}, rows, "facts");
}

/// The plots of one pattern: curves over one covariate, maps over two.
Data pattern_of(const Pattern& pattern, Figures& drawn) {
  Data out{Data::type::object}, figures{Data::type::list};
  out.set("by", covariates_in_words(pattern));
  out.set("share", percent(pattern.share()));
  if (pattern.covariates_size() == 1) {
    for (const Component component : {Component::kFirst, Component::kSecond})
      drawn.place(figures, plot_pattern(drawn.plots(), pattern, component), "");
    out.set("curves", Data{"figures", figures});
  } else {
    drawn.pair(figures, plot_pattern(drawn.plots(), pattern, Component::kFirst),
               plot_pattern(drawn.plots(), pattern, Component::kSecond),
               "Mean error over " + covariates_in_words(pattern));
    out.set("maps", Data{"figures", figures});
  }
  return out;
}

std::string table_of_distances(const Simulated& simulated) {
  Rows rows;
  for (const identification::SimulatedStatistic& s : simulated.statistics()) {
    const auto with_unit = [&](double value) {
      return s.unit().empty() ? figure(value) : figure(value) + " " + s.unit();
    };
    rows.push_back({s.name(), with_unit(s.distance()), with_unit(s.by_chance_95()), chance(log10_of(s.p())),
                    s.agrees().kind_case() != google::protobuf::Value::kBoolValue ? "too few robots"
                    : s.agrees().bool_value()                                     ? "agrees"
                                                                                  : "differs",
                    with_unit(s.base_distance())});
  }
  return table_of(
      {"statistic", "distance", "95 % under the null", "p value", "result", "distance of the base model"}, rows);
}

}  // namespace

Section improvement_section(const Identification& found, Figures& drawn) {
  const Result& result = found.result();
  Data section{Data::type::object}, half{Data::type::list}, full{Data::type::list};
  drawn.place(half, plot_horizon(drawn.plots(), found.horizon()), "Prediction error over the horizon");
  if (!result.effects().empty())
    drawn.place(half, plot_steps(drawn.plots(), found.steps(), errors_of(result).floor.value_or(std::nan(""))),
                "Error after each accepted effect; dashed: noise floor");
  // A full-width plot if there are many robots.
  constexpr int kMany = 24;
  drawn.place(result.robots_size() > kMany ? full : half, plot_robots(drawn.plots(), result.robots()),
              "Error per robot, largest first");
  if (half.is_empty_list() && full.is_empty_list()) return std::nullopt;
  set_text(section, "bounds_how", result.improvement().bounds_how());
  set_text(section, "which", result.held_out().in_words());
  set_text(section, "floor_how", result.noise_floor_how());
  if (result.has_replicates()) {
    Data replicates{Data::type::object};
    replicates.set("groups", std::to_string(result.replicates().groups()));
    replicates.set("differs", figure(result.replicates().floor_mm()));
    replicates.set("repeats", figure(result.replicates().repeatable_mm()));
    section.set("replicates", replicates);
  }
  if (!half.is_empty_list()) section.set("half", Data{"figures", half});
  if (!full.is_empty_list()) section.set("full", Data{"figures", full});
  return section;
}

Section unexplained_section(const Unexplained& u, Figures& drawn) {
  if (u.in_words().empty()) return std::nullopt;
  Data section{Data::type::object}, patterns{Data::type::list};
  section.set("words", u.in_words());
  section.set("table", compared(u));
  for (const Pattern& pattern : u.patterns())
    if (!pattern.covariates().empty()) patterns << pattern_of(pattern, drawn);
  section.set("patterns", patterns);
  return section;
}

Section residual_map_section(const Identification& found, Figures& drawn) {
  Data figures{Data::type::list};
  std::set<std::string> done;
  const auto find = [&](const std::string& target) -> const ResidualMap* {
    const auto at = std::find_if(found.maps().begin(), found.maps().end(),
                                 [&](const ResidualMap& map) { return map.target() == target; });
    return at == found.maps().end() ? nullptr : &*at;
  };
  const auto add = [&](const std::string& target, const auto& plot) {
    drawn.pair(figures, plot(When::kBefore), plot(When::kAfter),
               fmt::format("Residual {} over the arena", words_of(target)));
  };
  for (const ResidualMap& map : found.maps()) {
    const std::string& target = map.target();
    if (!done.insert(target).second) continue;
    if (target.size() > 2 && (target.ends_with("_x") || target.ends_with("_y"))) {
      const std::string stem = target.substr(0, target.size() - 2);
      const ResidualMap *x = find(stem + "_x"), *y = find(stem + "_y");
      if (x != nullptr && y != nullptr) {
        done.insert({stem + "_x", stem + "_y"});
        add(stem, [&](When when) { return plot_arrows(drawn.plots(), *x, *y, when); });
        continue;
      }
    }
    add(target, [&](When when) { return plot_map(drawn.plots(), map, when); });
  }
  if (figures.is_empty_list()) return std::nullopt;
  return Data{"figures", figures};
}

Section simulated_section(const Identification& found, Figures& drawn) {
  const Simulated& simulated = found.result().simulated();
  Data section{Data::type::object}, figures{Data::type::list};
  for (const identification::Distribution& distribution : found.distributions())
    drawn.place(figures, plot_distribution(drawn.plots(), distribution), "");
  drawn.place(figures, plot_speed_over_time(drawn.plots(), found.speed_over_time()), "");
  drawn.place(figures, plot_msd(drawn.plots(), found.msd()), "");
  if (figures.is_empty_list() && simulated.statistics().empty()) return std::nullopt;
  if (found.result().has_simulated()) {
    Data how{Data::type::object};
    how.set("seeds", std::to_string(simulated.seeds()));
    how.set("engine", simulated.engine());
    how.set("unit", simulated.unit());
    how.set("words", simulated.in_words());
    section.set("how", how);
  }
  if (!simulated.statistics().empty()) section.set("table", table_of_distances(simulated));
  if (!figures.is_empty_list()) section.set("plots", Data{"figures", figures});
  return section;
}

}  // namespace kilotwin::identify::report
