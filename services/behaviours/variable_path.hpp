/// Paths of variables, as recording.variable of an experiment names them.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace kilotwin::behaviours {

/// `loop::table[3].x`, `mydata->x`.
struct VariablePath {
  struct Step {
    enum class Kind : std::uint8_t { kField, kIndex, kArrow };
    Kind kind = Kind::kField;
    std::string field;        ///< with kField and kArrow
    std::uint64_t index = 0;  ///< with kIndex
  };
  std::string function;  ///< empty: any, or none
  std::string name;
  std::vector<Step> steps;

  static constexpr std::size_t kLongest = 200;
  /// Throws UserError: what is wrong with the path, without a place.
  [[nodiscard]] static VariablePath parse(std::string_view text);
};

}  // namespace kilotwin::behaviours
