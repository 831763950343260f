#include "services/behaviours/compiler_common.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <sstream>
#include <string_view>
#include <system_error>

#include "core/base/error.hpp"
#include "core/os/files.hpp"
#include "services/behaviours/program_text.hpp"
#include "services/behaviours/runtime_files.hpp"
#include "services/behaviours/sha256.hpp"

namespace kilotwin::behaviours {
namespace fs = std::filesystem;
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

}  // namespace

fs::path unpacked_runtime(const fs::path& cache) {
  static const std::string content_hash = [] {
    std::string all;
    for (const RuntimeFile& file : runtime_files())
      all.append(file.name).append(1, '\0').append(file.text).append(1, '\0');
    return sha256_hex(all);
  }();
  fs::path folder = cache / ("runtime-" + content_hash.substr(0, 16));
  for (const RuntimeFile& file : runtime_files()) {
    const fs::path path = folder / file.name;
    if (os::read_if_there(path) == file.text) continue;
    std::error_code error;
    fs::create_directories(path.parent_path(), error);
    os::write_file(path, file.text);
  }
  return folder;
}

std::vector<std::string> define_flags(const std::vector<std::string>& defines) {
  auto is_macro = [](std::string_view define) {
    const std::string_view name = define.substr(0, define.find('='));
    return !name.empty() && !is_digit(name[0]) && define.find('\n') == std::string_view::npos &&
           std::all_of(name.begin(), name.end(), [](char c) { return c == '_' || is_digit(c) || is_letter(c); });
  };
  std::vector<std::string> flags;
  for (const std::string& define : defines) {
    if (!is_macro(define)) {
      throw UserError("--define " + define + ": not a macro; write NAME or NAME=VALUE, as in TAU_S=2.5");
    }
    flags.push_back("-D" + define);
  }
  return flags;
}

Kilolib kilolib_for(const std::vector<fs::path>& sources, const CompileOptions& options) {
  const Kilolib shown = kilolib_of(sources);
  if (options.kilolib == "kilobot") return Kilolib::kKilobot;
  if (options.kilolib == "kilogrid") return shown == Kilolib::kKilobot ? Kilolib::kKilogridRobot : shown;
  if (options.kilolib.empty()) return shown;
  throw UserError("--kilolib " + options.kilolib + ": no such library; it takes kilobot or kilogrid");
}

std::vector<std::string> kilolib_flags(Kilolib kilolib, const fs::path& runtime) {
  if (kilolib == Kilolib::kKilobot) return {};
  return {"-DKILOTWIN_KILOGRID", "-isystem", (runtime / "kilogrid").string()};
}

fs::path kilolib_source(Kilolib kilolib, const fs::path& runtime) {
  if (kilolib == Kilolib::kKilobot) return {};
  return runtime / (kilolib == Kilolib::kKilogridRobot ? "kilogrid/robot.c" : "kilogrid/module.c");
}

std::vector<std::string> kilolib_notes(Kilolib kilolib, const fs::path& source) {
  if (kilolib == Kilolib::kKilobot) return {};
  return {source.string() +
          (kilolib == Kilolib::kKilogridRobot ? ": a robot's program for the Kilogrid; compiled with "
                                              : ": a module's program for the Kilogrid; compiled with ") +
          "the Kilogrid's kilolib"};
}

void check_sources(const std::vector<fs::path>& sources) {
  if (sources.empty()) throw UserError("no program given; name one or more C files");
  for (const fs::path& source : sources) {
    std::error_code error;
    if (!fs::is_regular_file(source, error)) {
      throw UserError(source.string() +
                      ": no such file; a program is one or more C or C++ files, or a .so of `kilotwin build`");
    }
    if (source.extension() != ".c" && !is_cpp(source)) {
      throw UserError(
          source.string() +
          ": not a C or C++ source; a program is one or more .c or .cpp files, or a .so of `kilotwin build`");
    }
  }
}

namespace {

/// Removes ":NUMBER" from the end. False if there is none.
bool drop_number(std::string_view& text) {
  std::size_t end = text.size();
  while (end > 0 && is_digit(text[end - 1])) --end;
  if (end == text.size() || end < 2 || text[end - 1] != ':') return false;
  text = text.substr(0, end - 1);
  return true;
}

/// A compiler's line "FILE:LINE:COLUMN: error: WHAT" or "... fatal error: WHAT", the latter rewritten as "error".
std::optional<std::string> compiler_error(std::string_view line) {
  for (const std::string_view mark : {": error: ", ": fatal error: "}) {
    const std::size_t at = line.find(mark);
    if (at == std::string_view::npos) continue;
    const std::string_view place = line.substr(0, at);
    std::string_view file = place;
    const bool has_column = drop_number(file), has_line = has_column && drop_number(file);
    if (has_line) {
      return std::string(place) + ": error: " + std::string(line.substr(at + mark.size()));
    }
  }
  return std::nullopt;
}

/// An assembler's line "FILE:LINE: Error: WHAT", about an asm statement.
std::optional<std::string> assembler_error(std::string_view line) {
  constexpr std::string_view kMark = ": Error: ";
  const std::size_t at = line.find(kMark);
  if (at == std::string_view::npos) return std::nullopt;
  const std::string_view place = line.substr(0, at);
  std::string_view file = place;
  if (!drop_number(file)) return std::nullopt;
  return std::string(place) + ":1: error: " + std::string(line.substr(at + kMark.size()));
}

/// Whether a line of gcc, collect2 or clang (C locale) reports a failure of one of its own processes: it was killed, ran out of
/// memory or disk space, or had an internal error.
bool is_machine_failure(std::string_view line) {
  for (const std::string_view mark :
       {"signal terminated program", "terminated with signal", "internal compiler error",
        "unable to execute command", "command failed due to signal", "out of memory", "virtual memory exhausted",
        "Cannot allocate memory", "No space left on device"}) {
    if (line.find(mark) != std::string_view::npos) return true;
  }
  return false;
}

std::size_t linker_complaint(std::string_view line) {
  return std::min(line.find("undefined reference"), line.find("multiple definition"));
}

/// A linker's line "... FILE:LINE: WHAT". The linker gives file names without directories, and no columns.
std::optional<std::string> linker_error(std::string_view line, const std::vector<fs::path>& sources) {
  const std::size_t at = linker_complaint(line);
  if (at == std::string_view::npos || at < 2 || line.substr(at - 2, 2) != ": ") return std::nullopt;
  const std::string_view place = line.substr(0, at - 2);
  std::string_view file = place;
  if (!drop_number(file)) return std::nullopt;
  const std::string number(place.substr(file.size()));
  if (const std::size_t before = file.find_last_of(": "); before != std::string_view::npos)
    file.remove_prefix(before + 1);
  std::string named(file);
  for (const fs::path& source : sources) {
    if (source.filename() == fs::path(named).filename()) named = source.string();
  }
  // Cut off the place of the other definition: it names a temporary file.
  return named + number + ":1: error: " + std::string(line.substr(at, line.find("; ", at) - at));
}

/// Error for a program without main(). The linker's place is the call in the runtime, which would mislead the user.
std::optional<std::string> missing_main(std::string_view line, const fs::path& source) {
  if (line.find("undefined reference to `main'") == std::string_view::npos) return std::nullopt;
  return source.string() +
         ":1:1: error: there is no main(); a program has one that calls kilo_init() and kilo_start(setup, loop)";
}

/// An error line without a place, e.g. of the compiler driver. It is attributed to `source`.
std::optional<std::string> placeless_error(std::string_view line, const fs::path& source) {
  const std::size_t at = std::min(linker_complaint(line), line.find("error"));
  if (at == std::string_view::npos) return std::nullopt;
  return source.string() + ":1:1: error: " + std::string(line.substr(at));
}

}  // namespace

os::ProcessResult run_compiler(const std::vector<std::string>& arguments) {
  os::ProcessResult result = os::run_process(arguments);
  if (result.end.signal != 0) {
    throw RunError(arguments[0] + " was ended by " + os::signal_name(result.end.signal) +
                   " while it compiled; is memory short? Run this command again");
  }
  if (result.end.well()) return result;
  std::istringstream stream(result.errors);
  for (std::string line; std::getline(stream, line);) {
    // Compilers indent the source lines that they quote; those are skipped.
    if (!line.empty() && line[0] != ' ' && is_machine_failure(line))
      throw RunError(arguments[0] + " failed: " + line +
                     "; this is no error of the program: run this command again");
  }
  return result;
}

namespace {

/// A note about names in capitals that the program lacks, which a makefile may define; empty: none.
std::string note_of_macros(const std::vector<std::string>& errors) {
  constexpr std::array<std::string_view, 2> kMarks{"' undeclared", "' was not declared"};  // of C and of C++
  constexpr std::string_view kCapitals = "ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_";
  std::set<std::string> names;
  for (const std::string& error : errors) {
    const std::size_t end = std::min(error.find(kMarks[0]), error.find(kMarks[1]));
    if (end == std::string::npos || end == 0) continue;
    const std::size_t quote = error.rfind('\'', end - 1);
    if (quote == std::string::npos) continue;
    const std::string name = error.substr(quote + 1, end - quote - 1);
    if (name.size() > 1 && name.find_first_not_of(kCapitals) == std::string::npos) names.insert(name);
  }
  if (names.empty()) return "";
  std::string note = "\nnote: if a makefile defines what is undeclared, add --define";
  for (const std::string& name : names) note += ' ' + name + "=VALUE";
  return note;
}

}  // namespace

std::string all_errors(const std::string& output, const std::vector<fs::path>& sources) {
  std::vector<std::string> lines;
  std::istringstream stream(output);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  std::vector<std::string> found;
  auto look_for = [&](auto parse) {
    if (!found.empty()) return;
    for (const std::string& line : lines) {
      const std::optional<std::string> error = parse(line);
      if (error && std::find(found.begin(), found.end(), *error) == found.end()) found.push_back(*error);
    }
  };
  look_for(compiler_error);
  look_for(assembler_error);
  look_for([&](const std::string& line) { return missing_main(line, sources.front()); });
  look_for([&](const std::string& line) { return linker_error(line, sources); });
  look_for([&](const std::string& line) { return placeless_error(line, sources.front()); });
  if (found.empty()) return sources.front().string() + ":1:1: error: the compiler failed";
  constexpr std::size_t kMost = 20;
  std::string all = found[0];
  for (std::size_t n = 1; n < std::min(found.size(), kMost); ++n) all += '\n' + found[n];
  if (found.size() > kMost) all += "\n(" + std::to_string(found.size() - kMost) + " more errors)";
  return all + note_of_macros(found);
}

std::set<std::string> undefined_names(const std::string& errors) {
  constexpr std::string_view kMark = "undefined reference to `";
  std::set<std::string> names;
  for (std::size_t at = errors.find(kMark); at != std::string::npos; at = errors.find(kMark, at + 1)) {
    const std::size_t first = at + kMark.size();
    names.insert(errors.substr(first, errors.find_first_of("'(", first) - first));
  }
  names.erase("main");
  return names;
}

}  // namespace kilotwin::behaviours
