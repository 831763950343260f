/// Reader of protobuf text files that remembers the place of every field, so that later checks can report it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/error.hpp"

namespace google::protobuf {
class Message;
}

namespace kilotwin {

/// The source of each field's value: a place in a file, or an option of the command line. A field is identified by its path from the
/// root message, "robots[0].layout.grid.pitch_mm".
class SourceLocations {
 public:
  /// Fields that are absent have the place FILE:1:1.
  explicit SourceLocations(std::string_view file);

  /// Sets the place of a field. Line and column count from 1.
  void set_place(std::string path, std::string_view file, int line, int column);
  /// Sets the source of a field and all fields below it to an option, such as "--set seed=3".
  void set_option(std::string path, std::string_view option);
  /// Copies the places of `from` and all fields below it in `other` to `to`.
  void adopt(const SourceLocations& other, std::string_view from, std::string_view to);

  /// "FILE:LINE:COLUMN" or the option. For an absent field, the place of the innermost enclosing message that is present.
  [[nodiscard]] std::string where(std::string_view path) const;
  /// The error "WHERE: TEXT". `text` has the form "what is wrong; what would be right".
  [[nodiscard]] UserError error(std::string_view path, std::string_view text) const;

 private:
  struct Place {
    std::uint32_t source;
    int line, column;  ///< 0: the source is an option
  };
  std::uint32_t source(std::string_view name);

  std::vector<std::string> sources_;
  std::map<std::string, Place, std::less<>> places_;
};

/// The content of a file of at most 32 MiB. Throws UserError that begins with `where` if it cannot be read.
[[nodiscard]] std::string read_text(const std::filesystem::path& file, std::string_view where);

/// Parses `text`, the content of `file`, into the empty `message`, and stores the place of each field in `locations`.
void parse_text(std::string_view file, const std::string& text, google::protobuf::Message& message,
                SourceLocations& locations);

}  // namespace kilotwin
