/// What the fields of an experiment may hold: one table that validation, error texts and docs/reference share.
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

/// The range of one numeric field, or of each element where it is a list.
struct FieldRule {
  std::string_view field;  ///< "Arena.width_mm": message and field
  double min, max;
  std::string_view unit;  ///< "" where the number has none
  Lower lower = Lower::kIncluded;

  [[nodiscard]] bool allows(double value) const {
    return (lower == Lower::kIncluded ? value >= min : value > min) && value <= max;
  }
};

/// Every numeric field of Experiment and of Model.
[[nodiscard]] std::span<const FieldRule> field_rules();
/// Null for fields that are not numbers.
[[nodiscard]] const FieldRule* rule_of(const google::protobuf::FieldDescriptor& field);

/// "40..1000000", "above 33", "at least 0", "above 0, at most 10", "any".
[[nodiscard]] std::string range_text(const FieldRule& rule);
/// What the field takes, for the second half of an error: "a number, 40..1000000 mm", "one of PLANAR".
[[nodiscard]] std::string value_text(const google::protobuf::FieldDescriptor& field);
/// The default as one writes it in a file; "" where there is none.
[[nodiscard]] std::string default_text(const google::protobuf::FieldDescriptor& field);
/// The shortest decimal that gives up to 15 digits of the number: 1000000, 0.005.
[[nodiscard]] std::string number_text(double value);

/// "count, behaviour, layout, body".
[[nodiscard]] std::string field_names(const google::protobuf::Descriptor& type);
/// "did you mean width_mm?" if a field's name is near, else "its fields are ...".
[[nodiscard]] std::string field_suggestion(std::string_view wrong, const google::protobuf::Descriptor& type);

}  // namespace kilotwin
