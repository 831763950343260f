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
    return *pool_.FindMessageTypeByName("kilotwin.proto." + name);
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

}  // namespace

std::string experiment_schema(const std::filesystem::path& descriptors) {
  return sections(Schema{descriptors}, "Experiment");
}
std::string model_schema(const std::filesystem::path& descriptors) {
  return sections(Schema{descriptors}, "Model");
}

}  // namespace kilotwin::reference
