/// Functions that compiling for the simulation and compiling for the robot share.
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "core/os/process.hpp"
#include "services/behaviours/compiler.hpp"
#include "services/behaviours/program_text.hpp"

namespace kilotwin::behaviours {

/// Writes the embedded runtime to a folder of the cache that its content names, unless it exists, and returns the folder.
[[nodiscard]] std::filesystem::path unpacked_runtime(const std::filesystem::path& cache);

/// The -D options. Throws UserError if a definition is not NAME or NAME=VALUE.
[[nodiscard]] std::vector<std::string> define_flags(const std::vector<std::string>& defines);

/// The library that the options name, else the one that the sources show.
[[nodiscard]] Kilolib kilolib_for(const std::vector<std::filesystem::path>& sources, const CompileOptions& options);

/// The -D and -isystem options for a library's headers, before those of kilolib; none for kilolib itself.
[[nodiscard]] std::vector<std::string> kilolib_flags(Kilolib, const std::filesystem::path& runtime);

/// The source that is compiled with a program for its library, or "".
[[nodiscard]] std::filesystem::path kilolib_source(Kilolib, const std::filesystem::path& runtime);

/// A line for the user about a library that is not kilolib itself, or nothing.
[[nodiscard]] std::vector<std::string> kilolib_notes(Kilolib, const std::filesystem::path& source);

/// Throws UserError if there is no source, or one is not a readable C or C++ file.
void check_sources(const std::vector<std::filesystem::path>& sources);

/// Runs a compiler or a linker. Throws RunError for failures that are no error of the sources: a signal that ends the compiler
/// or a program that it started, lack of memory, a full disk, an internal compiler error.
[[nodiscard]] os::ProcessResult run_compiler(const std::vector<std::string>& arguments);

/// The errors in a compiler's or linker's output, one per line: "FILE:LINE:COLUMN: error: ...", at most 20. FILE is a source,
/// spelled as in `sources`, or a header.
[[nodiscard]] std::string all_errors(const std::string& output, const std::vector<std::filesystem::path>& sources);

/// Functions and variables but main() that a linker reports as undefined.
[[nodiscard]] std::set<std::string> undefined_names(const std::string& errors);

}  // namespace kilotwin::behaviours
