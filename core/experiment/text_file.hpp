/// Reading of protobuf text files such that every complaint, of grammar now or of meaning later, names its place.
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

/// Where the value of each field came from: a place in a file, or an option of the command line. A field is named by
/// its path from the root message, "robots[0].layout.grid.pitch_mm".
class SourceLocations {
 public:
  /// `file` answers for whatever is absent, as FILE:1:1.
  explicit SourceLocations(std::string_view file);

  /// Line and column count from 1.
  void set_place(std::string path, std::string_view file, int line, int column);
  /// The field and all below it were set by an option, such as "--set seed=3".
  void set_option(std::string path, std::string_view option);
  /// Takes over what `other` knows of `from` (and below it) as the place of `to`.
  void adopt(const SourceLocations& other, std::string_view from, std::string_view to);

  /// "FILE:LINE:COLUMN", or the option; for an absent field that of the nearest message around it which is present.
  [[nodiscard]] std::string where(std::string_view path) const;
  /// The error "WHERE: TEXT", `text` being "what is wrong; what would be right".
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

/// The content of a file of at most 32 MiB. Throws UserError, beginning with `where`, if it cannot be read.
[[nodiscard]] std::string read_text(const std::filesystem::path& file, std::string_view where);

/// Parses `text`, the content of `file`, into the empty `message` and notes where each field stands.
void parse_text(std::string_view file, const std::string& text, google::protobuf::Message& message,
                SourceLocations& locations);

}  // namespace kilotwin
