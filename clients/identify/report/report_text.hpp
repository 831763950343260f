/// Words and numbers of the report, from parts of the document that may be missing or of another form.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

namespace kilotwin::identify::report {

using nlohmann::json;

/// A part of an object; null where there is none.
[[nodiscard]] const json& part(const json& from, const char* key);
[[nodiscard]] std::string text(const json& from, const char* key);
[[nodiscard]] std::optional<double> number(const json& from, const char* key);

/// Three digits; a dash where there is none.
[[nodiscard]] std::string figure(std::optional<double> value);
[[nodiscard]] std::string percent(std::optional<double> share);
/// A probability as markup, as a power of ten where it is small.
[[nodiscard]] std::string chance(std::optional<double> log10_p);

/// What an effect depends on, as what "it depends on ..." goes on with.
[[nodiscard]] std::string covariates_of(const json& effect);
/// Whether it is the tracker's.
[[nodiscard]] bool is_measurement(const json& effect);
/// What it acts on, as markup.
[[nodiscard]] std::string acts_on_of(const json& effect);

}  // namespace kilotwin::identify::report
