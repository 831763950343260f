/// Companions: sources that a program needs besides the named ones. A makefile would name them; here they are searched for.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "services/behaviours/compiler.hpp"
#include "services/behaviours/program_text.hpp"

namespace kilotwin::behaviours {

/// The linker's messages about a program with undefined functions or variables.
struct Incomplete {
  std::string errors;
};

/// How a program is made of its sources.
struct Making {
  Kilolib kilolib;   ///< whose library the program is written for
  std::string kind;  ///< whatever the search's result depends on besides the sources: the processor, macros
  /// Compiles and links, or returns the cached result. Throws Incomplete if something is undefined, UserError for other errors.
  std::function<CompiledProgram(const ProgramText&)> make;
  /// A source after preprocessing, or "" on failure.
  std::function<std::string(const std::filesystem::path&)> preprocessed;
};

/// Makes a program of `given`, and adds companions until it links or no further one is found (sources_with). The result of a
/// search is kept in the cache as long as the files around the program stay as they are. Throws UserError with the errors, and
/// the notes about the sources.
[[nodiscard]] CompiledProgram with_companions(const std::vector<std::filesystem::path>& given,
                                              const std::filesystem::path& cache, const Making&);

}  // namespace kilotwin::behaviours
