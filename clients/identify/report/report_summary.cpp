#include "clients/identify/report/report_summary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "clients/identify/result/large_error.hpp"

namespace kilotwin::identify::report {
namespace {

using identification::Identification, identification::Result;

/// "one effect", "3 effects".
std::string effects_in_words(int count) { return count == 1 ? "one effect" : fmt::format("{} effects", count); }

/// Share of the explainable mean square error that the model removes: (before^2 - after^2) / (before^2 - floor^2).
std::optional<double> share_explained(const Errors& e) {
  if (!e.before || !e.after || !e.floor) return std::nullopt;
  const double could = *e.before * *e.before - *e.floor * *e.floor;
  if (could <= 0) return std::nullopt;
  return std::clamp((*e.before * *e.before - *e.after * *e.after) / could, 0.0, 1.0);
}

/// The headline: the variables on which the motion depends.
void add_headline(Data& page, const Result& result) {
  std::vector<std::string> phrases;
  bool tracker = false;
  for (const identification::Effect& effect : result.effects()) {
    if (is_measurement(effect)) {
      tracker = true;
      continue;
    }
    const std::string phrase = covariates_of(effect.covariates());
    if (std::find(phrases.begin(), phrases.end(), phrase) == phrases.end()) phrases.push_back(phrase);
  }
  const Data yes{Data::type::bool_true};
  if (tracker) page.set("tracker", yes);
  if (phrases.empty() && !tracker) page.set(result.unexplained().large() ? "no_cause" : "no_effect", yes);
  if (phrases.empty() && tracker) page.set("only_tracker", yes);
  if (phrases.empty()) return;
  Data depends{Data::type::object};
  depends.set("first", phrases[0]);
  if (phrases.size() > 1) depends.set("second", phrases[1]);
  if (phrases.size() > 2) depends.set("others", yes);
  page.set("depends", depends);
}

/// Nothing is held out: the effects without an error.
Data unconfirmed_of(const Result& result) {
  Data out{Data::type::object};
  const int count = result.effects_size();
  out.set("significant", count == 0   ? "No tested effect is significant."
                         : count == 1 ? "One effect is significant in the data of the fit."
                                      : fmt::format("{} effects are significant in the data of the fit.", count));
  const std::string& why = result.held_out().in_words();
  out.set("why", why.empty() ? "The prediction error is unknown." : why);
  return out;
}

void add_errors(Data& to, const Result& result, const Errors& e) {
  to.set("horizon", fmt::format("{:g}", result.has_horizon_s() ? result.horizon_s() : 10));
  to.set("error_before", figure(e.before));
  if (result.effects_size() == 0) {
    std::string none =
        result.check().dropped().empty() ? "No tested effect is significant." : "No effect is written.";
    if (e.floor && *e.before > kLargeErrorRatio * *e.floor)
      none += " The error above the noise floor depends on no tested covariate.";
    to.set("none", none);
    return;
  }
  to.set("count", effects_in_words(result.effects_size()));
  to.set("error_after", figure(e.after));
  const identification::Improvement& less = result.improvement();
  if (!less.has_low_mm()) return;
  to.set("less_low", figure(less.low_mm()));
  to.set("less_high", figure(known(less.has_high_mm(), less.high_mm())));
}

void add_free_robots(Data& to, const identification::FreeRobots& free) {
  const auto after_mm = number(free.after_mm());
  if (!after_mm || !(free.share_of_rows() < 0.98)) return;
  Data out{Data::type::object};
  out.set("share", percent(free.share_of_rows()));
  out.set("free_before", figure(number(free.before_mm())));
  out.set("free_after", figure(after_mm));
  to.set("free", out);
}

/// Sentences of the result about its data and its search.
Data remarks_of(const Result& result) {
  Data out{Data::type::list};
  const auto add = [&](const std::string& text) {
    if (!text.empty()) out << Data{"remark", text};
  };
  add(result.command_lag().in_words());
  add(result.numbering().in_words());
  add(result.check().in_words());
  if (result.unexplained().perhaps())
    add("A part of the error is perhaps unexplained: too few data are held out to be sure.");
  if (const int dropped = result.check().dropped_size(); dropped > 0)
    add(fmt::format("{} not written: held-out data are predicted no better with {}.",
                    dropped == 1 ? "One effect was" : fmt::format("{} effects were", dropped),
                    dropped == 1 ? "it" : "them"));
  return out;
}

void add_simulated(Data& to, const identification::Simulated& simulated) {
  if (simulated.agrees().kind_case() != google::protobuf::Value::kBoolValue) return;
  const auto differs = [](const identification::SimulatedStatistic& s) {
    return s.agrees().kind_case() == google::protobuf::Value::kBoolValue && !s.agrees().bool_value();
  };
  const auto differ = std::count_if(simulated.statistics().begin(), simulated.statistics().end(), differs);
  Data out{Data::type::object};
  out.set("outcome", differ == 0 ? "agree with the measured tracks"
                                 : fmt::format("differ from the measured tracks in {} of {} statistics", differ,
                                               simulated.statistics_size()));
  to.set("simulations", out);
}

void add_faults(Data& to, const Result& result) {
  const auto of_test = std::count_if(result.faults().begin(), result.faults().end(),
                                     [](const identification::Fault& fault) { return fault.set() == "test"; });
  const auto set = [&](const char* name, std::ptrdiff_t count) {
    if (count == 0) return;
    Data out{Data::type::object};
    out.set("faults_in_words", count == 1 ? "a fault" : fmt::format("{} faults", count));
    out.set("are", count == 1 ? "is" : "are");
    to.set(name, out);
  };
  set("train_faults", result.faults_size() - of_test);
  set("test_faults", of_test);
}

/// The sentences below the headline.
void add_verdict(Data& page, const Result& result) {
  const Errors e = errors_of(result);
  if (!e.before) {
    page.set("unconfirmed", unconfirmed_of(result));
    return;
  }
  Data out{Data::type::object};
  add_errors(out, result, e);
  add_free_robots(out, result.free());
  out.set("remarks", remarks_of(result));
  if (result.unexplained().large()) out.set("systematic", figure(result.unexplained().systematic_mm()));
  if (e.floor) out.set(e.after && *e.after <= *e.floor ? "at_floor" : "above_floor", figure(e.floor));
  add_simulated(out, result.simulated());
  if (const auto share = share_explained(e); share && result.effects_size() > 0)
    out.set("explained", percent(share));
  add_faults(out, result);
  set_text(out, "next", result.next());
  page.set("confirmed", out);
}

html::Bar bar_of(const std::string& kind, const std::string& name, double length, const std::string& value,
                 std::optional<double> low, std::optional<double> high) {
  return {name, kind, length, value, low && high ? fmt::format("{} to {} (95 %)", figure(low), figure(high)) : ""};
}

/// The errors as bars, with their confidence intervals.
std::string bars_of_errors(const Result& result) {
  const Errors e = errors_of(result);
  if (!e.before || !e.after) return "";
  const auto bar = [](const char* kind, double value, const identification::Accuracy& of) {
    return bar_of(kind, kind, value, figure(value) + " mm", known(of.has_rmse_low_mm(), of.rmse_low_mm()),
                  known(of.has_rmse_high_mm(), of.rmse_high_mm()));
  };
  std::vector<html::Bar> all{bar("before", *e.before, result.before()), bar("after", *e.after, result.after())};
  if (e.floor) all.push_back(bar_of("floor", "noise floor", *e.floor, figure(e.floor) + " mm", {}, {}));
  return html::bars(all, std::max({*e.before, *e.after, e.floor.value_or(0), result.before().rmse_high_mm()}));
}

/// Bars of any quantity. A bar starts at `from`.
std::string bars_of(const google::protobuf::RepeatedPtrField<identification::Bar>& bars) {
  double most = 0;
  std::vector<html::Bar> all;
  for (const identification::Bar& bar : bars) {
    most = std::max({most, bar.value() - bar.from(), bar.has_high() ? bar.high() - bar.from() : 0.0});
    all.push_back(bar_of(bar.kind(), bar.name(), bar.value() - bar.from(),
                         fmt::format("{} {}", figure(bar.value()), bar.unit()), known(bar.has_low(), bar.low()),
                         known(bar.has_high(), bar.high())));
  }
  return html::bars(all, most);
}

}  // namespace

Errors errors_of(const Result& result) {
  return {number(result.before().rmse_mm()), number(result.after().rmse_mm()),
          known(result.has_noise_floor_mm(), result.noise_floor_mm())};
}

void add_summary(Data& page, const Identification& found) {
  if (found.has_headline())
    page.set("headline", found.headline());
  else
    add_headline(page, found.result());
  if (found.has_verdict())
    page.set("verdict", found.verdict());
  else
    add_verdict(page, found.result());
  page.set("bars", found.bars().empty() ? bars_of_errors(found.result()) : bars_of(found.bars()));
}

}  // namespace kilotwin::identify::report
