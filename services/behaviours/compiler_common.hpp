/// What compiling for the simulation and for the real robot share.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/os/process.hpp"
#include "services/behaviours/compiler.hpp"

namespace kilotwin::behaviours {

/// Writes the embedded runtime below the cache, once per content, and returns its folder.
[[nodiscard]] std::filesystem::path unpacked_runtime(const std::filesystem::path& cache);

/// -D options; throws UserError where a macro's name is none.
[[nodiscard]] std::vector<std::string> define_flags(const std::vector<std::string>& defines);

/// Throws UserError where there is no source, or one that is not a readable file named *.c.
void check_sources(const std::vector<std::filesystem::path>& sources);

/// Runs a compiler or a linker. A signal that ends it or a program that it has started, memory that runs out, a full disk and an
/// internal error say nothing about the sources: throws RunError.
[[nodiscard]] os::ProcessResult run_compiler(const std::vector<std::string>& arguments);

/// The first error of a compiler's or linker's output as one line, "FILE:LINE:COLUMN: error: ...", and how many more there
/// are. FILE is one of the sources as they were named, or a header.
[[nodiscard]] std::string first_error(const std::string& output, const std::vector<std::filesystem::path>& sources);

}  // namespace kilotwin::behaviours
