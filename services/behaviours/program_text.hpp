/// Prepares a program's sources for the compiler without its makefile. Published programs come with a copy of kilolib, with headers
/// in folders that the makefile names, and with further sources that it links.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <set>
#include <string>
#include <vector>

namespace kilotwin::behaviours {

/// Whose library a program is written for.
enum class Kilolib : std::uint8_t {
  kKilobot,        ///< kilolib as published
  kKilogridRobot,  ///< the Kilogrid's: IR_message_t, utils.h, kilob_*.h
  kKilogridModule  ///< that of the Kilogrid's cells: module_init(), set_IR_message()
};

/// Finds out by names that only one of the libraries has, in the sources and in the local headers that they include.
[[nodiscard]] Kilolib kilolib_of(const std::vector<std::filesystem::path>& sources);

struct ProgramText {
  /// The files to compile, in order: the sources, or copies in the cache with changed #include lines. Copies keep the line numbers
  /// and name the original by #line.
  std::vector<std::filesystem::path> files;
  /// The originals of `files`, in the same order. Copies of kilolib are left out.
  std::vector<std::filesystem::path> sources;
  /// Lines for the user: files that were ignored or found elsewhere.
  std::vector<std::string> notes;
  /// Local files that the sources include, directly or indirectly.
  std::set<std::filesystem::path> included;
};

/// Reads the sources. Throws UserError if all of them are copies of kilolib.
[[nodiscard]] ProgramText program_text(const std::vector<std::filesystem::path>& sources,
                                       const std::filesystem::path& cache, Kilolib kilolib);

/// Searches the folders around the sources for files that define one of the missing functions or variables and no main().
/// `preprocessed` returns a source after preprocessing, or "" on failure.
[[nodiscard]] std::vector<std::filesystem::path> sources_with(
    const std::set<std::string>& missing, const ProgramText& text,
    const std::function<std::string(const std::filesystem::path&)>& preprocessed);

/// One line per source file around a program, in the order of the search: path, size, time of its last change.
[[nodiscard]] std::string files_around(const ProgramText& text);

/// Whether a source's file name has an ending of C++.
[[nodiscard]] bool is_cpp(const std::filesystem::path& source);

}  // namespace kilotwin::behaviours
