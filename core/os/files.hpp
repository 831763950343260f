/// Whole files in and out, and the directory where compiled programs are kept.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace kilotwin::behaviours {

/// The file's octets; nothing where it cannot be read.
[[nodiscard]] std::optional<std::string> read_file(const std::filesystem::path&);

/// Writes the file whole or not at all: under another name in the same directory, then by rename. False where that fails.
[[nodiscard]] bool write_file(const std::filesystem::path&, std::string_view octets);

/// A directory that this user may write to: `wanted` if given, else $XDG_CACHE_HOME/kilotwin or ~/.cache/kilotwin; where
/// none of them can be had, a private directory of this user among the system's temporary files. Throws RunError where that fails too.
[[nodiscard]] std::filesystem::path cache_directory(const std::filesystem::path& wanted);

}  // namespace kilotwin::behaviours
