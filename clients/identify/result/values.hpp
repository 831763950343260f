/// JSON values of the result message (idl/identification.proto) from numbers that may be unknown.
#pragma once

#include <google/protobuf/struct.pb.h>

#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>

namespace kilotwin::identify {

using JsonList = google::protobuf::ListValue;
using JsonObject = google::protobuf::Struct;
using JsonValue = google::protobuf::Value;

/// A truth, a number or a text. Numbers that are not finite become null, since JSON has none.
template <typename T> [[nodiscard]] JsonValue json_value(const T& of) {
  JsonValue value;
  if constexpr (std::is_same_v<T, bool>) {
    value.set_bool_value(of);
  } else if constexpr (std::is_convertible_v<T, std::string>) {
    value.set_string_value(of);
  } else if (const auto number = static_cast<double>(of); std::isfinite(number)) {
    value.set_number_value(number);
  } else {
    value.set_null_value(google::protobuf::NULL_VALUE);
  }
  return value;
}
[[nodiscard]] inline JsonValue json_null() { return json_value(std::numeric_limits<double>::quiet_NaN()); }
/// Null if there is none.
template <typename T> [[nodiscard]] JsonValue json_value(const std::optional<T>& known) {
  return known ? json_value(*known) : json_null();
}

template <typename Range> [[nodiscard]] JsonList json_list(const Range& values) {
  JsonList list;
  for (const auto& value : values) *list.add_values() = json_value(value);
  return list;
}
[[nodiscard]] inline JsonValue json_value(JsonList list) {
  JsonValue value;
  *value.mutable_list_value() = std::move(list);
  return value;
}

/// Fills a repeated field of numbers, or of texts.
template <typename Range> void assign(google::protobuf::RepeatedField<double>* field, const Range& values) {
  field->Clear();
  for (const auto& value : values) field->Add(static_cast<double>(value));
}
template <typename Range> void assign(google::protobuf::RepeatedPtrField<std::string>* field, const Range& values) {
  field->Clear();
  for (const auto& value : values) *field->Add() = value;
}

}  // namespace kilotwin::identify
