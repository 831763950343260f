/// The sources of a program as the compiler gets them. Programs come as they lie in their repositories: with a copy of kilolib
/// next to them or in another folder, with headers that a makefile would find and files that it would link.
#pragma once

#include <filesystem>
#include <functional>
#include <set>
#include <string>
#include <vector>

namespace kilotwin::behaviours {

struct ProgramText {
  /// What to compile, in order: the sources, or copies below the cache where an #include had to be written anew (their lines
  /// keep their numbers, and #line names the original).
  std::vector<std::filesystem::path> files;
  /// The sources that remain, in the order of `files`: a copy of kilolib itself is left out.
  std::vector<std::filesystem::path> sources;
  /// What was left aside or found elsewhere, one line each.
  std::vector<std::string> notes;
  /// Local headers and sources that these sources include, directly or not.
  std::set<std::filesystem::path> included;
};

/// Reads the sources. Throws UserError where no program remains.
[[nodiscard]] ProgramText program_text(const std::vector<std::filesystem::path>& sources,
                                       const std::filesystem::path& cache);

/// Further sources near these that define one of the missing functions or variables and no main(); empty where there are none.
/// `preprocessed` gives a source after its preprocessor, or nothing.
[[nodiscard]] std::vector<std::filesystem::path> sources_with(
    const std::set<std::string>& missing, const ProgramText& text,
    const std::function<std::string(const std::filesystem::path&)>& preprocessed);

/// Whether a source is C++ by its name.
[[nodiscard]] bool is_cpp(const std::filesystem::path& source);

}  // namespace kilotwin::behaviours
