/// Texts and numbers of the report, from the messages of a result (idl/identification.proto), and the values of its templates.
#pragma once

#include <google/protobuf/struct.pb.h>

#include <optional>
#include <string>
#include <vector>

#include "clients/report/html.hpp"
#include "idl/identification.pb.h"

namespace kilotwin::identify::report {

using html::Data;
using Texts = google::protobuf::RepeatedPtrField<std::string>;

/// A value of the result; nothing if it is no number.
[[nodiscard]] std::optional<double> number(const google::protobuf::Value&);
/// An optional field, given whether it is there.
[[nodiscard]] inline std::optional<double> known(bool there, double value) {
  return there ? std::optional(value) : std::nullopt;
}

/// Three digits; a dash if absent.
[[nodiscard]] std::string figure(std::optional<double> value);
[[nodiscard]] std::string percent(std::optional<double> share);
/// A probability; small ones as a power of ten.
[[nodiscard]] std::string chance(std::optional<double> log10_p);
/// The logarithm of a probability, which rounding may have made 0.
[[nodiscard]] std::optional<double> log10_of(std::optional<double> p);

/// Covariates as the object of "depends on ...".
[[nodiscard]] std::string covariates_of(const Texts& covariates);
/// Whether the effect acts on the measurement.
[[nodiscard]] bool is_measurement(const identification::Effect&);
/// The target of an effect in words.
[[nodiscard]] std::string acts_on_in_words(const std::string& acts_on);

/// Sets a text unless it is empty: a template takes an empty one as present.
void set_text(Data& to, const std::string& name, const std::string& text);
/// Texts as a table, by the template of all tables.
[[nodiscard]] std::string table_of(const std::vector<std::string>& heads,
                                   const std::vector<std::vector<std::string>>& rows, const char* kind = "");

}  // namespace kilotwin::identify::report
