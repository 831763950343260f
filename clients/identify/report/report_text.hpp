/// Texts and numbers of the report, from the JSON of a result (clients/identify/result). Entries may be absent.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

namespace kilotwin::identify::report {

using nlohmann::json;

/// An entry of an object; null if absent.
[[nodiscard]] const json& part(const json& from, const char* key);
[[nodiscard]] std::string text(const json& from, const char* key);
[[nodiscard]] std::optional<double> number(const json& from, const char* key);

/// Three digits; a dash if absent.
[[nodiscard]] std::string figure(std::optional<double> value);
[[nodiscard]] std::string percent(std::optional<double> share);
/// A probability as markup; small ones as a power of ten.
[[nodiscard]] std::string chance(std::optional<double> log10_p);

/// The covariates of an effect as the object of "depends on ...".
[[nodiscard]] std::string covariates_of(const json& effect);
/// Whether the effect acts on the measurement.
[[nodiscard]] bool is_measurement(const json& effect);
/// The target of an effect, as markup.
[[nodiscard]] std::string acts_on_of(const json& effect);

}  // namespace kilotwin::identify::report
