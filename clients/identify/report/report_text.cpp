#include "clients/identify/report/report_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "clients/identify/report/report_plots.hpp"
#include "clients/identify/result/covariate_words.hpp"

namespace kilotwin::identify::report {
namespace {

/// A target of effects, as results name it.
struct TargetText {
  const char* in_words;
  bool measured = false;  ///< changes measurements, not motion
};

const std::map<std::string, TargetText>& targets() {
  static const std::map<std::string, TargetText> kTargets = {{"WHEEL_GAIN", {"wheel speeds (gain)"}},
                                                             {"WHEEL_OFFSET", {"wheel speeds (offset)"}},
                                                             {"TURN_RATE", {"turn rate"}},
                                                             {"BODY_DRIFT", {"drift in the body frame"}},
                                                             {"WORLD_DRIFT", {"drift in the world frame"}},
                                                             {"MEASURED_OFFSET", {"measured position", true}},
                                                             {"MEASURED_BODY_OFFSET", {"tracked point", true}},
                                                             {"MEASURED_SCALE", {"camera scale", true}},
                                                             {"MEASURED_HEADING", {"measured heading", true}},
                                                             {"NOISE", {"size of the motion noise"}}};
  return kTargets;
}

/// A whole number in superscript digits.
std::string superscript(int value) {
  constexpr std::array kDigits = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string out = value < 0 ? "⁻" : "";
  for (const char digit : std::to_string(std::abs(value))) out += kDigits[static_cast<std::size_t>(digit - '0')];
  return out;
}

std::vector<std::string> escaped(const std::vector<std::string>& texts) {
  std::vector<std::string> out;
  out.reserve(texts.size());
  for (const std::string& text : texts) out.push_back(html::escaped(text));
  return out;
}

}  // namespace

std::optional<double> number(const google::protobuf::Value& value) {
  return known(value.kind_case() == google::protobuf::Value::kNumberValue, value.number_value());
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
  if (!log10_p || !std::isfinite(*log10_p)) return "–";
  if (*log10_p > -2.5) return fmt::format("{:.2g}", std::pow(10, *log10_p));
  // Beyond, no digit of the exponent means anything.
  constexpr double kLeast = -99999;
  return "10" + superscript(static_cast<int>(std::lround(std::max(*log10_p, kLeast))));
}

std::optional<double> log10_of(std::optional<double> p) {
  return p ? std::optional(std::log10(std::max(*p, 1e-300))) : std::nullopt;
}

std::string covariates_of(const Texts& covariates) {
  std::string out;
  for (const std::string& covariate : covariates)
    out += (out.empty() ? "" : " and ") + covariate_in_words(covariate);
  return out.empty() ? "no covariate (constant)" : out;
}

bool is_measurement(const identification::Effect& effect) {
  const auto target = targets().find(effect.acts_on());
  return (target != targets().end() && target->second.measured) ||
         std::find(effect.covariates().begin(), effect.covariates().end(), "measurement") !=
             effect.covariates().end();
}

std::string acts_on_in_words(const std::string& acts_on) {
  const auto at = targets().find(acts_on);
  return at == targets().end() ? words_of(acts_on) : at->second.in_words;
}

void set_text(Data& to, const std::string& name, const std::string& text) {
  if (!text.empty()) to.set(name, text);
}

std::string table_of(const std::vector<std::string>& heads, const std::vector<std::vector<std::string>>& rows,
                     const char* kind) {
  html::Table table(escaped(heads));
  for (const std::vector<std::string>& row : rows) table.row(escaped(row));
  return table.text(kind);
}

}  // namespace kilotwin::identify::report
