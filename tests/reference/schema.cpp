#include "tests/reference/schema.hpp"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

#include "core/experiment/fields.hpp"
#include "idl/experiment.pb.h"
#include "idl/model.pb.h"

namespace kilotwin::reference {
namespace {

namespace pb = google::protobuf;
using pb::FieldDescriptor;

/// Up to this many values of an enumeration stand in the range column; more get a table of their own.
constexpr int kFewValues = 4;

/// The .proto files with their comments, which the descriptors of generated code lack.
class Schema {
 public:
  /// `descriptors`: what protoc --include_source_info --include_imports wrote.
  explicit Schema(const std::filesystem::path& descriptors) {
    std::ifstream in{descriptors, std::ios::binary};
    pb::FileDescriptorSet files;
    if (!files.ParseFromIstream(&in))
      throw std::runtime_error(fmt::format("{}: no set of descriptors", descriptors.string()));
    for (const pb::FileDescriptorProto& file : files.file()) {
      if (pool_.BuildFile(file) == nullptr) throw std::runtime_error(fmt::format("{}: is not valid", file.name()));
    }
  }

  [[nodiscard]] const pb::Descriptor& message(const std::string& name) const {
    const pb::Descriptor* const found = pool_.FindMessageTypeByName("kilotwin." + name);
    if (found == nullptr) throw std::runtime_error(fmt::format("there is no message {}", name));
    return *found;
  }

 private:
  pb::DescriptorPool pool_;
};

/// The comment of a descriptor: what stands before it, then what stands behind it. A line's first space is left out.
template <typename Descriptor> std::string comment_of(const Descriptor& descriptor) {
  pb::SourceLocation location;
  if (!descriptor.GetSourceLocation(&location)) return {};
  std::string text;
  for (const std::string* part : {&location.leading_comments, &location.trailing_comments}) {
    std::istringstream lines{*part};
    for (std::string line; std::getline(lines, line);)
      text += (line.starts_with(' ') ? line.substr(1) : line) + "\n";
  }
  return text;
}

/// "docs/explanation/x.md" as a link from docs/reference.
std::string with_links(const std::string& text) {
  static const std::regex page{R"(docs/([a-z-]+/([a-z-]+)\.md))"};
  return std::regex_replace(text, page, "[$2](../$1)");
}

/// The comment as one table cell.
template <typename Descriptor> std::string cell_of(const Descriptor& descriptor) {
  std::string cell;
  for (const char c : comment_of(descriptor)) {
    const char plain = c == '\n' ? ' ' : c;
    if (plain == ' ' && (cell.empty() || cell.back() == ' ')) continue;
    if (plain == '|') cell += '\\';
    cell += plain;
  }
  if (!cell.empty() && cell.back() == ' ') cell.pop_back();
  return with_links(cell);
}

bool has_table(const pb::EnumDescriptor& type) {
  bool commented = false;
  for (int i = 0; i < type.value_count(); ++i) commented = commented || !cell_of(*type.value(i)).empty();
  return commented || type.value_count() > kFewValues;
}

std::string anchor(std::string_view title) {
  std::string link;
  for (const char c : title) link += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return link;
}

/// The page that has the section of a type.
std::string page_of(const pb::FileDescriptor& file) {
  return file.name() == "experiment.proto" || file.name() == "door.proto" ? "experiment.md" : "model.md";
}

/// A section of the same page.
std::string link_to(const pb::Descriptor& type) {
  return fmt::format("[{}](#{})", type.name(), anchor(type.name()));
}

template <typename Type> std::string link_to(const Type& type, const pb::FileDescriptor& from) {
  const std::string page = page_of(*type.file()) == page_of(from) ? "" : page_of(*type.file());
  return fmt::format("[{}]({}#{})", type.name(), page, anchor(type.name()));
}

std::string range_of(const FieldDescriptor& field) {
  std::string names;
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_MESSAGE: return link_to(*field.message_type(), *field.file());
    case FieldDescriptor::CPPTYPE_STRING: return "text";
    case FieldDescriptor::CPPTYPE_BOOL: return "true, false";
    case FieldDescriptor::CPPTYPE_ENUM:
      if (has_table(*field.enum_type())) return link_to(*field.enum_type(), *field.file());
      for (int i = 0; i < field.enum_type()->value_count(); ++i)
        names += (i ? ", " : "") + field.enum_type()->value(i)->name();
      return names;
    default: break;
  }
  // The table of ranges knows fields by the descriptors of generated code.
  const FieldDescriptor* known = pb::DescriptorPool::generated_pool()->FindFieldByName(field.full_name());
  const FieldRule* rule = known == nullptr ? nullptr : rule_of(*known);
  if (rule == nullptr) throw std::runtime_error(field.full_name() + " has no rule in core/experiment/fields.cpp");
  return range_text(*rule);
}

std::string unit_of(const FieldDescriptor& field) {
  const FieldDescriptor* known = pb::DescriptorPool::generated_pool()->FindFieldByName(field.full_name());
  const FieldRule* rule = known == nullptr ? nullptr : rule_of(*known);
  return rule == nullptr ? "" : std::string{rule->unit};
}

void add_enum(std::string& page, const pb::EnumDescriptor& type) {
  page += fmt::format("\n### {}\n", type.name());
  if (const std::string comment = comment_of(type); !comment.empty()) page += "\n" + with_links(comment);
  page += "\n| value | meaning |\n|---|---|\n";
  for (int i = 0; i < type.value_count(); ++i)
    page += fmt::format("| `{}` | {} |\n", type.value(i)->name(), cell_of(*type.value(i)));
}

void add_message(std::string& page, const pb::Descriptor& message) {
  page += fmt::format("\n### {}\n", message.name());
  if (const std::string comment = comment_of(message); !comment.empty()) page += "\n" + with_links(comment);
  page += "\n| field | unit | default | range | meaning |\n|---|---|---|---|---|\n";
  for (int f = 0; f < message.field_count(); ++f) {
    const FieldDescriptor& field = *message.field(f);
    const std::string range = (field.is_repeated() ? "list of " : "") + range_of(field);
    page += fmt::format("| `{}` | {} | {} | {} | {} |\n", field.name(), unit_of(field), default_text(field), range,
                        cell_of(field));
  }
}

/// Messages and enumerations that `root` leads to, breadth first, as far as they stand on the same page.
std::string sections(const Schema& schema, const std::string& root) {
  std::vector<const pb::Descriptor*> found{&schema.message(root)};
  std::set<const void*> seen{found.front()};
  std::string page;
  for (std::size_t i = 0; i < found.size(); ++i) {
    add_message(page, *found[i]);
    for (int f = 0; f < found[i]->field_count(); ++f) {
      const FieldDescriptor& field = *found[i]->field(f);
      if (const pb::Descriptor* below = field.message_type();
          below != nullptr && page_of(*below->file()) == page_of(*found.front()->file()) &&
          seen.insert(below).second)
        found.push_back(below);
      if (const pb::EnumDescriptor* below = field.enum_type();
          below != nullptr && has_table(*below) && page_of(*below->file()) == page_of(*found.front()->file()) &&
          seen.insert(below).second)
        add_enum(page, *below);
    }
  }
  return page + "\n";
}

/// The unit that a key's ending states.
std::string unit_of_key(std::string_view key) {
  constexpr std::pair<std::string_view, std::string_view> kUnits[] = {
      {"_rad_s", "rad/s"}, {"_mm_s", "mm/s"}, {"_variance_s", "s"}, {"_rad", "rad"},
      {"_mm", "mm"},       {"_db", "dB"},     {"_s", "s"}};
  for (const auto& [ending, unit] : kUnits)
    if (key.ends_with(ending)) return std::string{unit};
  return "";
}

/// The value of a key of result.json.
std::string value_of_key(const FieldDescriptor& field) {
  if (field.is_map()) {
    const FieldDescriptor& value = *field.message_type()->map_value();
    return value.message_type() == nullptr ? "number by name" : link_to(*value.message_type()) + " by name";
  }
  std::string text;
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_MESSAGE: {
      const std::string& name = field.message_type()->full_name();
      text = name == "google.protobuf.Value"       ? "value or null"
             : name == "google.protobuf.ListValue" ? "list"
             : name == "google.protobuf.Struct"    ? "object"
                                                   : link_to(*field.message_type());
      break;
    }
    case FieldDescriptor::CPPTYPE_STRING: text = "text"; break;
    case FieldDescriptor::CPPTYPE_BOOL: text = "true, false"; break;
    case FieldDescriptor::CPPTYPE_DOUBLE: text = "number"; break;
    default: text = "whole number";
  }
  return (field.is_repeated() ? "list of " : "") + text;
}

/// The message that a key leads to; null: none of this schema.
const pb::Descriptor* below_key(const FieldDescriptor& field) {
  const pb::Descriptor* type =
      field.is_map() ? field.message_type()->map_value()->message_type() : field.message_type();
  return type != nullptr && type->file() == field.file() ? type : nullptr;
}

void add_keys(std::string& page, const pb::Descriptor& message) {
  page += fmt::format("\n### {}\n", message.name());
  if (const std::string comment = comment_of(message); !comment.empty()) page += "\n" + with_links(comment);
  page += "\n| key | unit | value | meaning |\n|---|---|---|---|\n";
  for (int f = 0; f < message.field_count(); ++f) {
    const FieldDescriptor& field = *message.field(f);
    page += fmt::format("| `{}` | {} | {} | {} |\n", field.name(), unit_of_key(field.name()), value_of_key(field),
                        cell_of(field));
  }
}

}  // namespace

std::string result_keys(const std::filesystem::path& descriptors) {
  const Schema schema{descriptors};
  std::vector<const pb::Descriptor*> found{&schema.message("identification.Result")};
  std::set<const pb::Descriptor*> seen{found.front()};
  std::string page;
  for (std::size_t i = 0; i < found.size(); ++i) {
    add_keys(page, *found[i]);
    for (int f = 0; f < found[i]->field_count(); ++f)
      if (const pb::Descriptor* below = below_key(*found[i]->field(f));
          below != nullptr && seen.insert(below).second)
        found.push_back(below);
  }
  return page + "\n";
}

std::string experiment_schema(const std::filesystem::path& descriptors) {
  return sections(Schema{descriptors}, "proto.Experiment");
}
std::string model_schema(const std::filesystem::path& descriptors) {
  return sections(Schema{descriptors}, "proto.Model");
}

}  // namespace kilotwin::reference
