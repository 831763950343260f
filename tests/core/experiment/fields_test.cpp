// The table of ranges against the schema.
#include <google/protobuf/descriptor.h>
#include <gtest/gtest.h>

#include <limits>
#include <set>
#include <vector>

#include "core/experiment/fields.hpp"
#include "idl/experiment.pb.h"
#include "idl/model.pb.h"

namespace kilotwin::test {
namespace {

namespace pb = google::protobuf;
using pb::FieldDescriptor;

/// All messages that can occur in an experiment or a model.
std::vector<const pb::Descriptor*> messages() {
  std::vector<const pb::Descriptor*> found{proto::Experiment::descriptor(), proto::Model::descriptor()};
  std::set<const pb::Descriptor*> seen{found.begin(), found.end()};
  for (std::size_t i = 0; i < found.size(); ++i) {
    for (int f = 0; f < found[i]->field_count(); ++f) {
      const pb::Descriptor* below = found[i]->field(f)->message_type();
      if (below != nullptr && seen.insert(below).second) found.push_back(below);
    }
  }
  return found;
}

bool is_number(const FieldDescriptor& field) {
  return field.cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE ||
         field.cpp_type() == FieldDescriptor::CPPTYPE_UINT32 || field.cpp_type() == FieldDescriptor::CPPTYPE_UINT64;
}

TEST(FieldRules, EveryNumberHasOneThatAllowsItsDefault) {
  std::set<const FieldRule*> used;
  for (const pb::Descriptor* message : messages()) {
    for (int f = 0; f < message->field_count(); ++f) {
      const FieldDescriptor& field = *message->field(f);
      const FieldRule* rule = rule_of(field);
      EXPECT_EQ(rule != nullptr, is_number(field)) << field.full_name();
      if (rule == nullptr) continue;
      used.insert(rule);
      EXPECT_EQ(rule->field, message->name() + "." + field.name());
      if (field.has_default_value()) {
        const std::string text = default_text(field);
        EXPECT_TRUE(rule->allows(std::stod(text))) << field.full_name();
      }
    }
  }
  EXPECT_EQ(used.size(), field_rules().size()) << "a rule names no field, or one twice";
}

TEST(FieldRules, Text) {
  EXPECT_EQ(range_text({"", 1, 4, ""}), "1..4");
  EXPECT_EQ(range_text({"", 0, 1e6, "", Lower::kExcluded}), "above 0, at most 1000000");
  EXPECT_FALSE((FieldRule{"", 0, 1, "", Lower::kExcluded}.allows(0)));
  EXPECT_TRUE((FieldRule{"", 0, 1, ""}.allows(0)));
  EXPECT_FALSE((FieldRule{"", 0, 1, ""}.allows(std::numeric_limits<double>::quiet_NaN())));
}

}  // namespace
}  // namespace kilotwin::test
