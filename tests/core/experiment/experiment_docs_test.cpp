// docs/experiment.md against the schema and the table of ranges.
#include <google/protobuf/descriptor.h>
#include <gtest/gtest.h>

#include <fstream>
#include <limits>
#include <map>
#include <set>
#include <sstream>
#include <vector>

#include "core/experiment/fields.hpp"
#include "core/experiment/text_file.hpp"
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

/// The range column of a field.
std::string documented_range(const FieldDescriptor& field) {
  std::string names;
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_MESSAGE: return "block";
    case FieldDescriptor::CPPTYPE_STRING: return "text";
    case FieldDescriptor::CPPTYPE_BOOL: return "true, false";
    case FieldDescriptor::CPPTYPE_ENUM:
      for (int i = 0; i < field.enum_type()->value_count(); ++i)
        names += (i ? ", " : "") + field.enum_type()->value(i)->name();
      return names;
    default: return rule_of(field) == nullptr ? "no rule" : range_text(*rule_of(field));
  }
}

std::string trimmed(const std::string& cell) {
  const std::size_t first = cell.find_first_not_of(' ');
  return first == std::string::npos ? "" : cell.substr(first, cell.find_last_not_of(' ') - first + 1);
}

/// Section -> field -> the cells unit, default and range.
std::map<std::string, std::map<std::string, std::vector<std::string>>> document() {
  std::ifstream in{std::string{KILOTWIN_SOURCE_DIR} + "/docs/experiment.md"};
  std::map<std::string, std::map<std::string, std::vector<std::string>>> sections;
  std::string line, section;
  while (std::getline(in, line)) {
    if (line.starts_with("#")) section = line.starts_with("### ") ? line.substr(4) : "";
    if (!line.starts_with("| `")) continue;
    std::istringstream row{line.substr(1)};
    std::vector<std::string> cells;
    for (std::string cell; std::getline(row, cell, '|');) cells.push_back(trimmed(cell));
    EXPECT_EQ(cells.size(), 5u) << line;
    sections[section][cells[0]] = {cells[1], cells[2], cells[3]};
  }
  return sections;
}

TEST(ExperimentDocument, StatesEveryFieldAsItIs) {
  auto sections = document();
  for (const pb::Descriptor* message : messages()) {
    auto& fields = sections[message->name()];
    for (int f = 0; f < message->field_count(); ++f) {
      const FieldDescriptor& field = *message->field(f);
      const FieldRule* rule = rule_of(field);
      const std::vector<std::string> expected{rule ? std::string{rule->unit} : "", default_text(field),
                                              documented_range(field)};
      const std::string name = "`" + field.name() + "`";
      EXPECT_EQ(fields[name], expected) << field.full_name();
      fields.erase(name);
    }
    EXPECT_TRUE(fields.empty()) << message->name() << " has no field " << fields.begin()->first;
    sections.erase(message->name());
  }
  EXPECT_TRUE(sections.empty()) << "there is no message " << sections.begin()->first;
}

TEST(ExperimentDocument, ExamplesAreReadable) {
  std::ifstream in{std::string{KILOTWIN_SOURCE_DIR} + "/docs/experiment.md"};
  std::string line, block;
  bool examples = false;
  int blocks = 0;
  const auto parse = [&] {
    if (block.empty()) return;
    proto::Experiment experiment;
    SourceLocations locations{"docs"};
    EXPECT_NO_THROW(parse_text("docs", block, experiment, locations)) << block;
    EXPECT_GT(experiment.robots_size(), 0) << block;
    block.clear();
    ++blocks;
  };
  while (std::getline(in, line)) {
    examples = examples || line == "## Examples";
    if (examples && line.starts_with("    ")) {
      block += line + "\n";
    } else {
      parse();
    }
  }
  parse();
  EXPECT_GE(blocks, 2);
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
