#include "core/experiment/clamp.hpp"

#include <google/protobuf/message.h>

#include <algorithm>
#include <vector>

#include "core/experiment/fields.hpp"

namespace kilotwin {
namespace {

namespace pb = google::protobuf;

double within(const FieldRule& rule, double value) {
  /// How far from an end that is excluded.
  constexpr double kAbove = 1e-6;
  return std::clamp(value, rule.lower == Lower::kExcluded ? rule.min + kAbove : rule.min, rule.max);
}

void clamp_doubles(pb::Message& message, const pb::FieldDescriptor& field, const FieldRule& rule) {
  const pb::Reflection& reflection = *message.GetReflection();
  if (!field.is_repeated())
    return reflection.SetDouble(&message, &field, within(rule, reflection.GetDouble(message, &field)));
  for (int i = 0; i < reflection.FieldSize(message, &field); ++i)
    reflection.SetRepeatedDouble(&message, &field, i,
                                 within(rule, reflection.GetRepeatedDouble(message, &field, i)));
}

}  // namespace

void clamp_to_ranges(pb::Message& message) {
  const pb::Reflection& reflection = *message.GetReflection();
  std::vector<const pb::FieldDescriptor*> fields;
  reflection.ListFields(message, &fields);
  for (const pb::FieldDescriptor* field : fields) {
    if (field->cpp_type() == pb::FieldDescriptor::CPPTYPE_DOUBLE) {
      if (const FieldRule* rule = rule_of(*field)) clamp_doubles(message, *field, *rule);
    } else if (field->cpp_type() == pb::FieldDescriptor::CPPTYPE_MESSAGE && field->is_repeated()) {
      for (int i = 0; i < reflection.FieldSize(message, field); ++i)
        clamp_to_ranges(*reflection.MutableRepeatedMessage(&message, field, i));
    } else if (field->cpp_type() == pb::FieldDescriptor::CPPTYPE_MESSAGE) {
      clamp_to_ranges(*reflection.MutableMessage(&message, field));
    }
  }
}

}  // namespace kilotwin
