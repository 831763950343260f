#include "clients/behaviours/compiler_common.hpp"

#include <algorithm>
#include <cctype>
#include <regex>
#include <sstream>
#include <system_error>

#include "clients/behaviours/files.hpp"
#include "clients/behaviours/runtime_files.hpp"
#include "clients/behaviours/sha256.hpp"
#include "core/base/error.hpp"

namespace kilotwin::behaviours {
namespace fs = std::filesystem;

fs::path unpacked_runtime(const fs::path& cache) {
  static const std::string content_hash = [] {
    std::string all;
    for (const RuntimeFile& file : runtime_files()) all.append(file.name).append(1, '\0').append(file.text).append(1, '\0');
    return sha256_hex(all);
  }();
  const fs::path folder = cache / ("runtime-" + content_hash.substr(0, 16));
  for (const RuntimeFile& file : runtime_files()) {
    const fs::path path = folder / file.name;
    if (read_file(path) == file.text) continue;
    std::error_code error;
    fs::create_directories(path.parent_path(), error);
    if (!write_file(path, file.text)) throw RunError(path.string() + ": cannot be written; is the disk full?");
  }
  return folder;
}

std::vector<std::string> define_flags(const std::vector<std::string>& defines) {
  static const std::regex kMacro("[A-Za-z_][A-Za-z0-9_]*(=[^\\n]*)?");
  std::vector<std::string> flags;
  for (const std::string& define : defines) {
    if (!std::regex_match(define, kMacro)) {
      throw UserError("--define " + define + ": not a macro; write NAME or NAME=VALUE, as in TAU_S=2.5");
    }
    flags.push_back("-D" + define);
  }
  return flags;
}

void check_sources(const std::vector<fs::path>& sources) {
  if (sources.empty()) throw UserError("no program given; name one or more C files");
  for (const fs::path& source : sources) {
    std::error_code error;
    if (!fs::is_regular_file(source, error)) {
      throw UserError(source.string() + ": no such file; a program is one or more C files, or a .so of `kilotwin build`");
    }
    if (source.extension() != ".c") {
      throw UserError(source.string() + ": not a C source; a program is one or more .c files, or a .so of `kilotwin build`");
    }
  }
}

namespace {

/// The linker knows sources by their names alone.
std::string as_named(const std::string& file, const std::vector<fs::path>& sources) {
  for (const fs::path& source : sources) {
    if (source.filename() == fs::path(file).filename()) return source.string();
  }
  return file;
}

}  // namespace

std::string first_error_first(const std::string& output, const std::vector<fs::path>& sources) {
  static const std::regex kCompiler("(.+?:[0-9]+:[0-9]+: )(?:fatal )?error: (.*)");
  static const std::regex kLinker("(?:.*[: ])?([^: ]+\\.[ch])(:[0-9]+): ((?:undefined reference|multiple definition).*)");
  static const std::regex kAnywhere("(?:.*: )?((?:undefined reference|multiple definition|fatal error|error).*)");
  std::vector<std::string> lines;
  std::istringstream stream(output);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  const std::string first_source = sources.front().string();
  std::string head = first_source + ":1:1: error: the compiler failed";
  std::smatch match;
  auto search = [&](const std::regex& pattern, auto text) {
    const auto found = std::find_if(lines.begin(), lines.end(),
                                    [&](const std::string& line) { return std::regex_match(line, pattern); });
    if (found == lines.end()) return false;
    std::regex_match(*found, match, pattern);
    head = text();
    lines.erase(found);
    return true;
  };
  search(kCompiler, [&] { return match.str(1) + "error: " + match.str(2); }) ||
      search(kLinker, [&] { return as_named(match.str(1), sources) + match.str(2) + ":1: error: " + match.str(3); }) ||
      search(kAnywhere, [&] { return first_source + ":1:1: error: " + match.str(1); });
  for (const std::string& line : lines) head += "\n" + line;
  return head;
}

}  // namespace kilotwin::behaviours
