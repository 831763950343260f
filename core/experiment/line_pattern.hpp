/// A robot's line for a message that it hears, as `ListenerDoor.line` describes it: words, and numbers that fields in
/// braces stand for.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace kilotwin {

/// The values in a line. A field that the pattern lacks is absent.
struct HeardLine {
  std::vector<std::uint8_t> data;  ///< 1 to 9 octets
  std::optional<std::uint8_t> type;
  std::optional<std::uint64_t> sender;
  std::optional<double> distance_mm;
};

class LinePattern {
 public:
  /// Throws UserError where defect_of_line_pattern() finds something.
  explicit LinePattern(std::string_view pattern);
  /// Nothing where the line is none of a message. Any octets may stand in a line; an end of line counts as a blank.
  [[nodiscard]] std::optional<HeardLine> match(std::string_view line) const;

 private:
  enum class Kind : std::uint8_t { kText, kBlanks, kData, kType, kSender, kDistance, kSkip };
  struct Part {
    Kind kind;
    std::string text;  ///< of kText
  };
  friend std::string defect_of_line_pattern(std::string_view pattern);

  /// Reads the pattern; returns what is wrong with it, or an empty string.
  [[nodiscard]] static std::string parse(std::string_view pattern, std::vector<Part>& parts);
  [[nodiscard]] static bool take(const Part& part, std::string_view& rest, HeardLine& line);
  [[nodiscard]] static bool take_data(std::string_view& rest, HeardLine& line);

  std::vector<Part> parts_;
};

/// The error in a pattern and its correction, for people. Empty: no error.
[[nodiscard]] std::string defect_of_line_pattern(std::string_view pattern);

}  // namespace kilotwin
