/// Ranges and texts of an experiment's fields: one table for validation, error messages and docs/reference.
#pragma once

#include <limits>
#include <span>
#include <string>
#include <string_view>

namespace google::protobuf {
class Descriptor;
class FieldDescriptor;
}  // namespace google::protobuf

namespace kilotwin {

enum class Lower { kIncluded, kExcluded };

/// The range of a numeric field, or of each element of a list.
struct FieldRule {
  std::string_view field;  ///< "Arena.width_mm": message and field
  double min, max;
  std::string_view unit;  ///< "" for a number without unit
  Lower lower = Lower::kIncluded;

  [[nodiscard]] bool allows(double value) const {
    return (lower == Lower::kIncluded ? value >= min : value > min) && value <= max;
  }
};

/// The rules of all numeric fields of Experiment and Model.
[[nodiscard]] std::span<const FieldRule> field_rules();
/// The rule of a field, or null if it is not a number.
[[nodiscard]] const FieldRule* rule_of(const google::protobuf::FieldDescriptor& field);

/// A range as text: "40..1000000", "above 33", "at least 0", "above 0, at most 10", "any".
[[nodiscard]] std::string range_text(const FieldRule& rule);
/// The values that a field takes, for the second half of an error: "a number, 40..1000000 mm", "one of PLANAR".
[[nodiscard]] std::string value_text(const google::protobuf::FieldDescriptor& field);
/// The default in the notation of a file; "" if there is none.
[[nodiscard]] std::string default_text(const google::protobuf::FieldDescriptor& field);
/// The shortest decimal with at most 15 digits that rounds like the number: 1000000, 0.005.
[[nodiscard]] std::string number_text(double value);

/// The names of a message's fields: "count, behaviour, layout, body".
[[nodiscard]] std::string field_names(const google::protobuf::Descriptor& type);
/// "did you mean width_mm?" if a field has a similar name, else "its fields are ...".
[[nodiscard]] std::string field_suggestion(std::string_view wrong, const google::protobuf::Descriptor& type);

}  // namespace kilotwin
