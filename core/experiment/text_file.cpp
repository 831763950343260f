#include "core/experiment/text_file.hpp"

#include <fmt/format.h>
#include <google/protobuf/io/tokenizer.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/message.h>
#include <google/protobuf/text_format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <limits>
#include <optional>

#include "core/base/say.hpp"
#include "core/experiment/syntax_error.hpp"

namespace kilotwin {
namespace pb = google::protobuf;

namespace {

constexpr std::size_t kLargestFile = std::size_t{32} << 20;
/// Elements of a list beyond this number share the place of the list, which limits the memory for places.
constexpr int kLocatedElements = 100'000;
/// Limit of nested messages. An experiment has fewer than ten levels.
constexpr int kDeepestNesting = 100;

class FirstError : public pb::io::ErrorCollector {
 public:
  void AddError(int line, pb::io::ColumnNumber column, const std::string& message) override {
    if (!error) error = TextError{std::max(line, 0), std::max(column, 0), message};
  }
  std::optional<TextError> error;
};

void note_places(const pb::Message& message, const pb::TextFormat::ParseInfoTree& tree, const std::string& prefix,
                 std::string_view file, SourceLocations& locations) {
  const pb::Reflection& reflection = *message.GetReflection();
  std::vector<const pb::FieldDescriptor*> fields;
  reflection.ListFields(message, &fields);
  for (const pb::FieldDescriptor* field : fields) {
    const std::string path = prefix + field->name();
    const int size = field->is_repeated() ? std::min(reflection.FieldSize(message, field), kLocatedElements) : 1;
    for (int i = 0; i < size; ++i) {
      const int index = field->is_repeated() ? i : -1;
      const std::string element = field->is_repeated() ? fmt::format("{}[{}]", path, i) : path;
      const pb::TextFormat::ParseLocation place = tree.GetLocation(field, index);
      if (place.line >= 0) {
        if (field->is_repeated() && i == 0) locations.set_place(path, file, place.line + 1, place.column + 1);
        locations.set_place(element, file, place.line + 1, place.column + 1);
      }
      if (field->cpp_type() != pb::FieldDescriptor::CPPTYPE_MESSAGE) continue;
      if (const auto* nested = tree.GetTreeForNested(field, index)) {
        const pb::Message& below = field->is_repeated() ? reflection.GetRepeatedMessage(message, field, i)
                                                        : reflection.GetMessage(message, field);
        note_places(below, *nested, element + ".", file, locations);
      }
    }
  }
}

/// Whether `path` is `root` or below it.
bool lies_in(std::string_view path, std::string_view root) {
  return path.starts_with(root) &&
         (path.size() == root.size() || path[root.size()] == '.' || path[root.size()] == '[');
}

}  // namespace

SourceLocations::SourceLocations(std::string_view file) : sources_{std::string{file}} {}

std::uint32_t SourceLocations::source(std::string_view name) {
  // Search from the end, because successive places usually have the same source.
  const auto known = std::find(sources_.rbegin(), sources_.rend(), name);
  if (known != sources_.rend()) return static_cast<std::uint32_t>(sources_.rend() - known - 1);
  sources_.emplace_back(name);
  return static_cast<std::uint32_t>(sources_.size() - 1);
}

void SourceLocations::set_place(std::string path, std::string_view file, int line, int column) {
  places_.insert_or_assign(std::move(path), Place{source(file), line, column});
}

void SourceLocations::set_option(std::string path, std::string_view option) {
  auto at = places_.lower_bound(path);
  while (at != places_.end() && at->first.starts_with(path))
    at = lies_in(at->first, path) ? places_.erase(at) : ++at;
  places_.insert_or_assign(std::move(path), Place{source(option), 0, 0});
}

void SourceLocations::adopt(const SourceLocations& other, std::string_view from, std::string_view to) {
  for (auto at = other.places_.lower_bound(from); at != other.places_.end() && at->first.starts_with(from); ++at) {
    if (!lies_in(at->first, from)) continue;
    const Place& place = at->second;
    set_place(std::string{to} + at->first.substr(from.size()), other.sources_[place.source], place.line,
              place.column);
  }
}

std::string SourceLocations::where(std::string_view path) const {
  for (;;) {
    const auto at = places_.find(path);
    if (at != places_.end()) {
      const auto& [source, line, column] = at->second;
      return line == 0 ? sources_[source] : fmt::format("{}:{}:{}", sources_[source], line, column);
    }
    const std::size_t cut = path.find_last_of(".[");
    if (cut == std::string_view::npos) return sources_[0] + ":1:1";
    path = path.substr(0, cut);
  }
}

UserError SourceLocations::error(std::string_view path, std::string_view text) const {
  return UserError{fmt::format("{}: {}", where(path), text)};
}

std::string read_text(const std::filesystem::path& file, std::string_view where) {
  const std::string name = one_line(file.string());
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored)) {
    throw UserError{fmt::format("{}: {} is a directory; name a file", where, name)};
  }
  errno = 0;
  std::ifstream in{file, std::ios::binary};
  if (!in) {
    const char* const reason = errno != 0 ? std::strerror(errno) : "it cannot be opened";
    throw UserError{
        fmt::format("{}: {} cannot be read ({}); name a file that exists and may be read", where, name, reason)};
  }
  std::string text;
  std::vector<char> block(std::size_t{1} << 16);
  while (in.read(block.data(), static_cast<std::streamsize>(block.size())) || in.gcount() > 0) {
    text.append(block.data(), static_cast<std::size_t>(in.gcount()));
    if (text.size() > kLargestFile) {
      throw UserError{fmt::format("{}: {} has more than {} MiB; files of this kind are smaller", where, name,
                                  kLargestFile >> 20)};
    }
  }
  return text;
}

void parse_text(std::string_view file, const std::string& text, pb::Message& message, SourceLocations& locations) {
  pb::TextFormat::Parser parser;
  pb::TextFormat::ParseInfoTree tree;
  FirstError errors;
  parser.RecordErrorsTo(&errors);
  parser.WriteLocationsTo(&tree);
  parser.SetRecursionLimit(kDeepestNesting);
  pb::io::ArrayInputStream stream{text.data(), static_cast<int>(text.size())};
  if (!parser.Parse(&stream, &message)) {
    const TextError error =
        explained(text, *message.GetDescriptor(), errors.error.value_or(TextError{0, 0, "not readable"}));
    throw UserError{fmt::format("{}:{}:{}: {}", file, error.line + 1, error.column + 1, error.message)};
  }
  note_places(message, tree, "", file, locations);
}

}  // namespace kilotwin
