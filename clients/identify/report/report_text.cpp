#include "clients/identify/report/report_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "clients/identify/report/report_plots.hpp"
#include "clients/report/html.hpp"

namespace kilotwin::identify::report {
namespace {

using html::escaped;

const json kNothing;

/// A covariate as the object of "depends on ...".
std::string phrase_of(const std::string& covariate) {
  static const std::map<std::string, std::string> kPhrases = {{"time", "time in the run"},
                                                              {"position", "position"},
                                                              {"heading", "heading"},
                                                              {"command", "command"},
                                                              {"time_since_command", "time since the command"},
                                                              {"motor_time", "motor-on time"},
                                                              {"neighbours", "neighbours"},
                                                              {"world_frame", "world frame"},
                                                              {"measurement", "camera or tracker"},
                                                              {"robot", "robot"},
                                                              {"history", "history"}};
  const auto at = kPhrases.find(covariate);
  return at == kPhrases.end() ? words_of(covariate) : at->second;
}

}  // namespace

const json& part(const json& from, const char* key) {
  if (!from.is_object()) return kNothing;
  const auto at = from.find(key);
  return at == from.end() ? kNothing : *at;
}

std::string text(const json& from, const char* key) {
  const json& value = part(from, key);
  return value.is_string() ? value.get<std::string>() : value.is_null() ? "" : value.dump();
}

std::optional<double> number(const json& from, const char* key) {
  const json& value = part(from, key);
  if (!value.is_number()) return std::nullopt;
  return value.get<double>();
}

std::string figure(std::optional<double> value) {
  if (!value || !std::isfinite(*value)) return "–";
  const double size = std::abs(*value);
  if (size == 0) return "0";
  if (size >= 1e5 || size < 1e-4) return fmt::format("{:.2e}", *value);
  const int digits = std::clamp(2 - static_cast<int>(std::floor(std::log10(size))), 0, 6);
  return fmt::format("{:.{}f}", *value, digits);
}

std::string percent(std::optional<double> share) { return share ? fmt::format("{:.0f} %", 100 * *share) : "–"; }

std::string chance(std::optional<double> log10_p) {
  if (!log10_p) return "–";
  if (*log10_p > -2.5) return fmt::format("{:.2g}", std::pow(10, *log10_p));
  return fmt::format("10<sup>−{:.0f}</sup>", -*log10_p);
}

std::string covariates_of(const json& effect) {
  std::string out;
  for (const json& covariate : part(effect, "covariates")) {
    if (covariate.is_string()) out += (out.empty() ? "" : " and ") + phrase_of(covariate.get<std::string>());
  }
  return out.empty() ? "no covariate (constant)" : out;
}

bool is_measurement(const json& effect) {
  if (text(effect, "acts_on").starts_with("MEASURED")) return true;
  const json& covariates = part(effect, "covariates");
  return std::any_of(covariates.begin(), covariates.end(), [](const json& c) { return c == "measurement"; });
}

std::string acts_on_of(const json& effect) {
  static const std::map<std::string, std::string> kWords = {{"WHEEL_GAIN", "wheel speeds (gain)"},
                                                            {"WHEEL_OFFSET", "wheel speeds (offset)"},
                                                            {"TURN_RATE", "turn rate"},
                                                            {"BODY_DRIFT", "drift in the body frame"},
                                                            {"WORLD_DRIFT", "drift in the world frame"},
                                                            {"MEASURED_OFFSET", "measured position"},
                                                            {"MEASURED_BODY_OFFSET", "tracked point"},
                                                            {"MEASURED_SCALE", "camera scale"},
                                                            {"MEASURED_HEADING", "measured heading"}};
  const std::string name = text(effect, "acts_on");
  const auto at = kWords.find(name);
  return at == kWords.end() ? escaped(words_of(name)) : at->second;
}

}  // namespace kilotwin::identify::report
