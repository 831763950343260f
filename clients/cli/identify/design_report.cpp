#include "clients/cli/identify/design_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "clients/report/html.hpp"
#include "clients/report/plot.hpp"
#include "clients/report/templates.hpp"
#include "core/base/say.hpp"
#include "core/os/files.hpp"

namespace kilotwin::cli {
namespace {

using identify::Design, identify::DesignQuestion;

double robot_minutes(const Design& design) {
  return static_cast<double>(design.plan.robots.size()) * design.plan.duration_s() / 60;
}

nlohmann::ordered_json design_json(const Design& design, const DesignQuestion& question,
                                   const std::string& source) {
  nlohmann::ordered_json json{{"source", source},
                              {"criterion", question.of_parameters() ? "D-optimality" : "T-optimality"}};
  for (const identify::Candidate& candidate : question.models) json["models"].push_back(candidate.name);
  json["robots"] = design.plan.robots.size();
  json["duration_s"] = design.plan.duration_s();
  json["information_nat"] = design.planned.nat.back();
  json["information_nat_per_robot_minute"] = design.planned.nat.back() / robot_minutes(design);
  json["random_information_nat"] = design.random_nat;
  json["random_information_nat_per_robot_minute"] = design.random_nat / robot_minutes(design);
  json["compared_nat"] = design.needed_nat;
  json["compared_after_s"] = design.planned_s;
  json["random_compared_after_s"] = design.random_s;
  json["saved_share"] = design.saved();
  json["at_s"] = design.planned.at_s;
  json["information_until_nat"] = design.planned.nat;
  for (const identify::InformationCurve& curve : design.random)
    json["random_information_until_nat"].push_back(curve.nat);
  for (std::size_t p = 0; p < design.sd_after.size(); ++p) {
    const identify::DesignColumn& parameter = question.columns[p];
    json["parameters"].push_back(
        {{"name", parameter.name}, {"sd_now", parameter.sd}, {"sd_after", design.sd_after[p]}});
  }
  return json;
}

Plot information_plot(const Design& design) {
  Plot plot;
  plot.title = "Expected information of the recording";
  plot.x_name = "time";
  plot.x_unit = "s";
  plot.y_name = "information";
  plot.y_unit = "nat";
  PlotSeries random;
  random.name = "random commands, mean and range";
  random.points = false;
  random.band = true;
  PlotSeries planned;
  planned.name = "the plan";
  planned.x = random.x = design.planned.at_s;
  planned.y = design.planned.nat;
  for (std::size_t c = 0; c < random.x.size(); ++c) {
    double low = INFINITY, high = -INFINITY, sum = 0;
    for (const identify::InformationCurve& curve : design.random) {
      low = std::min(low, curve.nat[c]);
      high = std::max(high, curve.nat[c]);
      sum += curve.nat[c];
    }
    const double mean = sum / static_cast<double>(design.random.size());
    random.y.push_back(mean);
    random.error.push_back(std::max(high - mean, mean - low));
  }
  plot.series = {std::move(random), std::move(planned)};
  return plot;
}

/// Share of the robots' time under each command.
html::Table table_of_commands(const Design& design) {
  html::Table table({"command", "share of the time"});
  std::array<double, 4> ticks = {};
  for (const identify::PlannedRobot& robot : design.plan.robots) {
    std::int64_t since = 0;
    auto motion = identify::Motion::kStop;
    const auto until = [&](std::int64_t tick) {
      ticks[static_cast<std::size_t>(motion)] += static_cast<double>(tick - since);
      since = tick;
    };
    for (const identify::PlannedCommand& c : robot.commands) {
      until(c.tick);
      motion = c.motion;
    }
    until(design.plan.ticks);
  }
  const double all = ticks[0] + ticks[1] + ticks[2] + ticks[3];
  for (std::size_t m = 0; m < ticks.size(); ++m)
    table.row({name_of(static_cast<identify::Motion>(m)), fmt::format("{:.0f} %", 100 * ticks[m] / all)});
  return table;
}

html::Table table_of_parameters(const Design& design, const DesignQuestion& question) {
  html::Table table({"parameter", "standard deviation now", "after the recording"});
  for (std::size_t p = 0; p < design.sd_after.size(); ++p)
    table.row({html::escaped(question.columns[p].name), fmt::format("{:.3g}", question.columns[p].sd),
               fmt::format("{:.3g}", design.sd_after[p])});
  return table;
}

std::string page_of(const Design& design, const DesignQuestion& question, const std::string& source) {
  html::Data data{html::Data::type::object};
  data.set("verdict", design_in_words(design, question));
  data.set("information", html::image(plot_svg(information_plot(design)), "information over time"));
  data.set("random_plans", std::to_string(design.random.size()));
  if (!design.sd_after.empty()) {
    html::Data parameters{html::Data::type::object};
    parameters.set("table", table_of_parameters(design, question).text());
    data.set("parameters", parameters);
  }
  data.set("commands", table_of_commands(design).text());
  data.set("source", source);
  return html::page("Kilotwin: the next recording", html::rendered(html::templates::kDesign, data));
}

}  // namespace

std::string design_in_words(const Design& design, const DesignQuestion& question) {
  const std::string gain =
      design.saved() > 0 ? fmt::format("{:.0f} % less", 100 * design.saved()) : std::string("no less time");
  std::string text = fmt::format(
      "{} robots for {:.0f} s: {:.3g} nat expected, {:.3g} nat by random commands. {:.3g} nat{} take {:.0f} s by "
      "the "
      "plan and {:.0f} s by random commands, {}.",
      design.plan.robots.size(), design.plan.duration_s(), design.planned.nat.back(), design.random_nat,
      design.needed_nat,
      !question.of_parameters() && design.needed_nat >= identify::kDecision_nat ? ", a decision," : "",
      design.planned_s, design.random_s, gain);
  if (!question.of_parameters() && design.planned.nat.back() < identify::kDecision_nat)
    text += " The recording will probably not decide: plan a longer one, or more robots.";
  return text;
}

void write_design_report(const Design& design, const DesignQuestion& question, const std::string& source,
                         const std::filesystem::path& directory) {
  os::write_file(directory / "design.json", design_json(design, question, source).dump(2) + "\n");
  if (!Gnuplot::installed()) {
    say("kilotwin: no report.html: gnuplot is not installed; scripts/setup installs it");
    return;
  }
  os::write_file(directory / "report.html", page_of(design, question, source));
}

}  // namespace kilotwin::cli
