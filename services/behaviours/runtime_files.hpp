/// The sources of the robots' runtime (kilolib, C library), embedded in this program.
#pragma once

#include <span>
#include <string_view>

namespace kilotwin::behaviours {

struct RuntimeFile {
  std::string_view name;  ///< relative path: kilolib/kilolib.h, kilolib.c, core/math/elementary.c ...
  std::string_view text;
};

/// All files in a fixed order. runtime/embed.cmake generates the definition.
[[nodiscard]] std::span<const RuntimeFile> runtime_files();

}  // namespace kilotwin::behaviours
