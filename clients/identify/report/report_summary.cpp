#include "clients/identify/report/report_summary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "clients/report/html.hpp"

namespace kilotwin::identify::report {
namespace {

using html::escaped;

/// Share of the explainable mean square error that the model removes: (before^2 - after^2) / (before^2 - floor^2).
std::optional<double> share_explained(const Errors& e) {
  if (!e.before || !e.after || !e.floor) return std::nullopt;
  const double could = *e.before * *e.before - *e.floor * *e.floor;
  if (could <= 0) return std::nullopt;
  return std::clamp((*e.before * *e.before - *e.after * *e.after) / could, 0.0, 1.0);
}

/// Nothing is held out: the effects without an error.
std::string verdict_without_errors(const json& contract) {
  const std::string why = text(part(contract, "held_out"), "in_words");
  const json& effects = part(contract, "effects");
  const std::size_t count = effects.is_array() ? effects.size() : 0;
  const std::string found = count == 0   ? "No tested effect is significant."
                            : count == 1 ? "One effect is significant in the data of the fit."
                                         : fmt::format("{} effects are significant in the data of the fit.", count);
  return fmt::format("{} <b>{}</b>", found, escaped(why.empty() ? "The prediction error is unknown." : why));
}

}  // namespace

Errors errors_of(const json& contract) {
  return {number(part(contract, "before"), "rmse_mm"), number(part(contract, "after"), "rmse_mm"),
          number(contract, "noise_floor_mm")};
}

std::string headline(const json& contract) {
  std::vector<std::string> phrases;
  bool tracker = false;
  for (const json& effect : part(contract, "effects")) {
    if (is_measurement(effect)) {
      tracker = true;
      continue;
    }
    const std::string phrase = "<em>" + escaped(covariates_of(effect)) + "</em>";
    if (std::find(phrases.begin(), phrases.end(), phrase) == phrases.end()) phrases.push_back(phrase);
  }
  const char* const kSeen = "<em>the measurement</em> has effects of its own";
  if (phrases.empty() && !tracker)
    return part(part(contract, "unexplained"), "large") == json(true)
               ? "No tested effect explains how these data deviate from the base model"
               : "No tested effect improves on the base model";
  if (phrases.empty()) return fmt::format("The base model explains the motion, but {}", kSeen);
  std::string because = phrases[0];
  if (phrases.size() == 2) because += " and " + phrases[1];
  if (phrases.size() > 2) because += ", " + phrases[1] + " and others";
  return fmt::format("The motion deviates from the base model: it depends on {}{}", because,
                     tracker ? fmt::format("; {}", kSeen) : "");
}

std::string verdict(const json& contract) {
  const Errors e = errors_of(contract);
  const std::string ahead = fmt::format("{:g}", number(contract, "horizon_s").value_or(10));
  if (!e.before) return verdict_without_errors(contract);
  std::string out = fmt::format(
      "On held-out data, with a horizon of {} s, the base model has a prediction error of <b>{} mm</b> (root mean "
      "square)",
      ahead, figure(e.before));
  const std::size_t count = part(contract, "effects").is_array() ? part(contract, "effects").size() : 0;
  if (count == 0) {
    const json& not_written = part(part(contract, "check"), "dropped");
    out += not_written.is_array() && !not_written.empty() ? ". No effect is written."
                                                          : ". No tested effect is significant.";
    if (e.floor && e.before && *e.before > 1.15 * *e.floor)
      out += " The error above the noise floor depends on no tested covariate.";
  } else {
    out += fmt::format("; with {} in the model the error is <b>{} mm</b>.",
                       count == 1 ? "one effect" : fmt::format("{} effects", count), figure(e.after));
    const json& less = part(contract, "improvement");
    if (number(less, "low_mm"))
      out += fmt::format(" The reduction is {} to {} mm (95 %).", figure(number(less, "low_mm")),
                         figure(number(less, "high_mm")));
  }
  const json& free = part(contract, "free");
  if (const auto share = number(free, "share_of_rows"); share && number(free, "after_mm") && *share < 0.98)
    out += fmt::format(
        " For robots that stay away from walls and from each other ({} of the predictions) it is <b>{} mm</b> "
        "before and "
        "<b>{} mm</b> after.",
        percent(share), figure(number(free, "before_mm")), figure(number(free, "after_mm")));
  for (const char* of : {"command_lag", "numbering", "check"})
    if (const std::string words = text(part(contract, of), "in_words"); !words.empty()) out += " " + escaped(words);
  if (const json& dropped = part(part(contract, "check"), "dropped"); dropped.is_array() && !dropped.empty())
    out += fmt::format(" {} not written: held-out data are predicted no better with {}.",
                       dropped.size() == 1 ? "One effect was" : fmt::format("{} effects were", dropped.size()),
                       dropped.size() == 1 ? "it" : "them");
  if (part(part(contract, "unexplained"), "large") == json(true))
    out += fmt::format(" <a href=\"#unexplained\"><b>{} mm</b> of it are systematic and unexplained</a>.",
                       figure(number(part(contract, "unexplained"), "systematic_mm")));
  if (e.floor && e.after && *e.after <= *e.floor) {
    out += fmt::format(" That is at the noise floor of these robots and this tracker (about <b>{} mm</b>).",
                       figure(e.floor));
  } else if (e.floor) {
    out += fmt::format(" The noise floor of these robots and this tracker is about <b>{} mm</b>.", figure(e.floor));
  }
  const json& simulated = part(contract, "simulated");
  if (part(simulated, "agrees").is_boolean()) {
    std::size_t differ = 0, all = 0;
    for (const json& s : part(simulated, "statistics")) {
      ++all;
      if (part(s, "agrees") == json(false)) ++differ;
    }
    out += differ == 0
               ? " <a href=\"#simulated\">Simulations</a> of the written model agree with the measured "
                 "tracks."
               : fmt::format(
                     " <a href=\"#simulated\">Simulations</a> of the written model differ from the measured "
                     "tracks in {} of {} statistics.",
                     differ, all);
  }
  const json& faults = part(contract, "faults");
  if (const auto share = share_explained(e); share && count > 0)
    out += fmt::format(" The model removes {} of the explainable mean square error.", percent(share));
  const auto of_test =
      std::count_if(faults.begin(), faults.end(), [](const json& fault) { return text(fault, "set") == "test"; });
  const auto of_train = (faults.is_array() ? static_cast<std::ptrdiff_t>(faults.size()) : 0) - of_test;
  const auto in_words = [](std::ptrdiff_t n) {
    return fmt::format("<a href=\"#faults\">{}</a>, which {}", n == 1 ? "a fault" : fmt::format("{} faults", n),
                       n == 1 ? "is" : "are");
  };
  if (of_train > 0) out += fmt::format(" The data have {} excluded from the fit.", in_words(of_train));
  if (of_test > 0) out += fmt::format(" The test data have {} part of the error.", in_words(of_test));
  if (const std::string next = text(contract, "next"); !next.empty()) out += " <b>Next:</b> " + escaped(next);
  return out;
}

namespace {

/// "<b>1.2 mm</b> <small>1.1 to 1.3 (95 %)</small>", as markup.
std::string with_interval(std::optional<double> value, const std::string& unit, std::optional<double> low,
                          std::optional<double> high) {
  std::string out = fmt::format("<b>{} {}</b>", figure(value), escaped(unit));
  if (low && high) out += fmt::format(" <small>{} to {} (95 %)</small>", figure(low), figure(high));
  return out;
}

}  // namespace

std::string bars(const json& contract) {
  const Errors e = errors_of(contract);
  if (!e.before || !e.after) return "";
  const double most = std::max(
      {*e.before, *e.after, e.floor.value_or(0), number(part(contract, "before"), "rmse_high_mm").value_or(0)});
  const auto bar = [](const char* kind, const char* name, double value, const json& from) {
    return html::Bar{name, kind, value,
                     with_interval(value, "mm", number(from, "rmse_low_mm"), number(from, "rmse_high_mm"))};
  };
  std::vector<html::Bar> all{bar("before", "before", *e.before, part(contract, "before")),
                             bar("after", "after", *e.after, part(contract, "after"))};
  if (e.floor) all.push_back(bar("floor", "noise floor", *e.floor, json()));
  return html::bars(all, most);
}

std::string given_bars(const json& bars) {
  double most = 0;
  std::vector<html::Bar> all;
  for (const json& bar : bars) {
    const double from = number(bar, "from").value_or(0), value = number(bar, "value").value_or(0);
    const auto low = number(bar, "low"), high = number(bar, "high");
    most = std::max({most, value - from, high.value_or(0) - from});
    all.push_back({text(bar, "name"), text(bar, "kind"), value - from,
                   with_interval(number(bar, "value"), text(bar, "unit"), low, high)});
  }
  return html::bars(all, most);
}

}  // namespace kilotwin::identify::report
