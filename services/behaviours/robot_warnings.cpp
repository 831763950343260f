#include "services/behaviours/robot_warnings.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <optional>
#include <regex>
#include <set>
#include <sstream>
#include <system_error>
#include <tuple>

#include "core/os/files.hpp"
#include "core/os/process.hpp"
#include "services/behaviours/compiler_common.hpp"
#include "services/behaviours/program_text.hpp"
#include "services/behaviours/sha256.hpp"

namespace kilotwin::behaviours {
namespace fs = std::filesystem;
namespace {

using Arguments = std::vector<std::string>;

const Arguments kQuestions{"-Wformat",      "-Wconversion", "-Wno-sign-conversion",
                           "-Wtype-limits", "-Woverflow",   "-fdiagnostics-color=never"};

/// The compiler's own warnings that runs show. The others are about taste.
const Arguments kUsual{"-Wall",
                       "-Wno-unused",
                       "-Wno-main",
                       "-Wno-comment",
                       "-Wno-unknown-pragmas",
                       "-Wno-format",
                       "-fdiagnostics-color=never"};

struct Diagnostic {
  std::string file, line, column, text, option;
};

std::vector<Diagnostic> diagnostics(const std::string& output) {
  static const std::regex kForm(R"(^(.+?):(\d+):(\d+): warning: (.*?)(?: \[(-W[^\]]*)\])?$)");
  std::vector<Diagnostic> result;
  std::istringstream lines(output);
  for (std::string line; std::getline(lines, line);) {
    std::smatch match;
    if (line.size() < 2000 && std::regex_match(line, match, kForm))
      result.push_back({match[1], match[2], match[3], match[4], match[5]});
  }
  return result;
}

std::string readable(std::string text) {
  for (const char* quote : {"\xE2\x80\x98", "\xE2\x80\x99"}) {
    for (std::size_t at = text.find(quote); at != std::string::npos; at = text.find(quote))
      text.replace(at, 3, "'");
  }
  static const std::regex kAlias(R"( \{aka [^}]*\})");
  return std::regex_replace(text, kAlias, "");
}

/// Whether a warning belongs to the requested options and is about a type whose size differs on the robot.
bool is_relevant(const Diagnostic& found) {
  static const std::set<std::string> kOptions{"-Wconversion", "-Woverflow", "-Wtype-limits",
                                              "-Wshift-count-overflow", "-Wformat="};
  if (!kOptions.contains(found.option)) return false;
  if (found.option != "-Wconversion") return true;
  // Conversions matter only for types that are smaller on the robot.
  const std::string text = readable(found.text);
  for (const char* type : {"'int'", "'unsigned int'", "'size_t'", "'double'"}) {
    if (text.find(std::string("to ") + type) != std::string::npos) return true;
  }
  return false;
}

/// Integer type of a temporary or variable in the dump: size in octets and largest magnitude.
struct Value {
  int octets = 0;
  double most = 0;
  bool overflows = false;  ///< a 16-bit product or shift that may overflow, or a sum that contains one
  std::string place;
};

Value of_type(const std::string& type) {
  auto has = [&](const char* word) { return type.find(word) != std::string::npos; };
  if (has("*") || has("[") || has("struct") || has("union")) return {};
  const bool without_sign = has("unsigned") || has("uint");
  if (has("float") || has("double")) return {4, 1e38, false, ""};
  if (has("long long") || has("int64")) return {8, 1e19, false, ""};
  if (has("long") || has("int32")) return {4, 4e9, false, ""};
  if (has("char") || has("int8") || has("bool")) return {1, without_sign ? 255.0 : 128.0, false, ""};
  if (has("int") || has("short")) return {2, without_sign ? 65535.0 : 32768.0, false, ""};
  return {};
}

/// To check a source's syntax with the headers that programs are compiled with.
void append_host_headers(Arguments& arguments, const std::string& host, const fs::path& runtime) {
  std::string own = run_compiler({host, "-print-file-name=include"}).output;
  while (!own.empty() && own.back() == '\n') own.pop_back();
  arguments.insert(arguments.end(), {"-fsyntax-only", "-nostdinc", "-isystem", (runtime / "libc").string(),
                                     "-isystem", own, "-include", (runtime / "machine.h").string()});
}

std::optional<double> literal(const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (end == text.c_str()) return std::nullopt;
  return std::abs(value);
}

}  // namespace

std::vector<std::string> narrow_products(const std::string& gimple) {
  static const std::regex kDeclaration(
      R"(^\s*(?:\[[^\]]*\] *)?((?:[a-z_][A-Za-z0-9_]* )+)([A-Za-z_][A-Za-z0-9_.]*);$)");
  static const std::regex kStatement(
      R"(^\s*\[([^\]]+:\d+:\d+)\] *([A-Za-z_][A-Za-z0-9_.]*) = (?:\(([a-z][a-z ]*)\) )?(-?[A-Za-z0-9_.]+)(?: (\*|<<|\+|-) (-?[A-Za-z0-9_.]+))?;$)");
  std::vector<std::string> result;
  std::set<std::string> told;
  std::map<std::string, Value> values;
  auto value_of = [&](const std::string& name) -> Value {
    if (const auto number = literal(name)) return {2, *number, false, ""};
    const auto known = values.find(name);
    return known == values.end() ? Value{} : known->second;
  };
  std::istringstream lines(gimple);
  for (std::string line; std::getline(lines, line);) {
    if (line.size() > 400) continue;
    if (line == "}") values.clear();
    std::smatch match;
    if (std::regex_match(line, match, kDeclaration)) {
      values[match[2]] = of_type(match[1]);
      continue;
    }
    // The dump puts a location before each variable; remove them.
    static const std::regex kInner(R"(\[[^\]]+:\d+:\d+\] ?)");
    const std::size_t bracket = line.find(']');
    if (bracket == std::string::npos) continue;
    const std::string plain =
        line.substr(0, bracket + 1) + std::regex_replace(line.substr(bracket + 1), kInner, "");
    if (!std::regex_match(plain, match, kStatement)) continue;
    const std::string target = match[2];
    Value& to = values[target];
    const Value a = value_of(match[4]);
    const bool temporary = target.find('.') != std::string::npos;
    if (match[5].matched) {
      const Value b = value_of(match[6]);
      const std::string operation = match[5];
      if (to.octets != 2 || a.octets == 0 || b.octets == 0) continue;
      const double room = to.most > 40000 ? 65535 : 32767;
      const double most =
          operation == "*" ? a.most * b.most
          : operation == "<<"
              ? a.most * static_cast<double>(1ULL << std::min<unsigned>(static_cast<unsigned>(b.most), 40))
              : a.most + b.most;
      to.overflows = a.overflows || b.overflows || ((operation == "*" || operation == "<<") && most > room);
      to.place = a.overflows ? a.place : b.overflows ? b.place : std::string(match[1]);
      if (temporary) to.most = std::min(most, to.most);
    } else if (match[3].matched) {
      if (to.octets >= 4 && a.octets == 2 && a.overflows && told.insert(a.place).second) {
        result.push_back(
            a.place +
            ": warning: on the robot this is computed with 16 bits and may overflow before it is used with "
            "more; write (uint32_t) before the first operand");
      }
      if (temporary && to.octets <= 2 && a.octets > 0 && a.octets <= to.octets) {
        to.most = std::min(to.most, a.most);
        to.overflows = a.overflows;
        to.place = a.place;
      }
    } else if (temporary) {
      to.overflows = a.overflows;
      to.place = a.place;
      if (a.octets > 0) to.most = std::min(to.most, a.most);
    }
  }
  return result;
}

std::vector<std::string> robot_warnings(const std::vector<fs::path>& sources, const CompileOptions& options) {
  const std::string avr = os::find_executable("avr-gcc").string(), host = os::find_executable("gcc").string();
  if (avr.empty() || host.empty()) return {};
  const fs::path cache = os::cache_directory(options.cache_directory);
  const fs::path runtime = unpacked_runtime(cache);
  const Kilolib kilolib = kilolib_for(sources, options);
  const ProgramText text = program_text(sources, cache, kilolib);
  std::vector<std::string> result;
  const fs::path dump = cache / ("gimple." + std::to_string(getpid()) + '.' +
                                 std::to_string(std::hash<std::string>{}(sources.front().string())));
  for (std::size_t i = 0; i < text.files.size(); ++i) {
    if (is_cpp(text.files[i])) continue;
    Arguments shared{"-std=gnu11", "-funsigned-char", "-fpack-struct", "-fshort-enums", "-DF_CPU=8000000"};
    for (const std::string& flag : define_flags(options.defines)) shared.push_back(flag);
    shared.insert(shared.end(), kQuestions.begin(), kQuestions.end());
    for (const std::string& flag : kilolib_flags(kilolib, runtime)) shared.push_back(flag);
    shared.insert(shared.end(), {"-isystem", (runtime / "kilolib").string()});
    Arguments on_robot{
        avr, "-mmcu=atmega328p", "-S", "-O0", "-o", "/dev/null", "-fdump-tree-gimple-lineno=" + dump.string()};
    Arguments on_host{host};
    on_robot.insert(on_robot.end(), shared.begin(), shared.end());
    on_host.insert(on_host.end(), shared.begin(), shared.end());
    append_host_headers(on_host, host, runtime);
    on_robot.push_back(text.files[i].string());
    on_host.push_back(text.files[i].string());
    const os::ProcessResult robot = run_compiler(on_robot);
    if (!robot.end.well()) continue;
    std::set<std::string> alike;
    for (const Diagnostic& found : diagnostics(run_compiler(on_host).errors))
      alike.insert(found.file + ':' + found.line + found.option);
    std::set<std::string> lines;
    for (const Diagnostic& found : diagnostics(robot.errors)) {
      if (!is_relevant(found) || alike.contains(found.file + ':' + found.line + found.option)) continue;
      const std::string place = found.file + ':' + found.line;
      if (!lines.insert(place + found.option).second) continue;
      result.push_back(place + ':' + found.column +
                       ": warning: on the robot (int 16 bits, double 32): " + readable(found.text));
    }
    const auto gimple = os::read_if_there(dump);
    std::error_code error;
    fs::remove(dump, error);
    if (!gimple) continue;
    for (const std::string& warning : narrow_products(*gimple)) {
      const std::string place = warning.substr(0, warning.find(": warning"));
      if (!lines.contains(place.substr(0, place.rfind(':')) + "-Woverflow")) result.push_back(warning);
    }
  }
  const auto line_of = [](const std::string& warning) {
    static const std::regex kPlace(R"(^(.*?):(\d+):(\d+): )");
    std::smatch match;
    if (!std::regex_search(warning, match, kPlace)) return std::make_tuple(std::string(), 0, 0);
    const auto number = [&](std::size_t group) {
      return static_cast<int>(std::strtol(match[group].str().c_str(), nullptr, 10));
    };
    return std::make_tuple(match[1].str(), number(2), number(3));
  };
  std::sort(result.begin(), result.end(), [&](const std::string& a, const std::string& b) {
    return std::make_pair(line_of(a), a) < std::make_pair(line_of(b), b);
  });
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

namespace {

/// The compiler's own warnings, "FILE:LINE:COLUMN: warning: ... [-W...]".
std::vector<std::string> usual_warnings(const std::vector<fs::path>& sources, const CompileOptions& options) {
  const std::string host = os::find_executable("gcc").string();
  if (host.empty()) return {};
  const fs::path cache = os::cache_directory(options.cache_directory), runtime = unpacked_runtime(cache);
  const Kilolib kilolib = kilolib_for(sources, options);
  const ProgramText text = program_text(sources, cache, kilolib);
  std::vector<std::string> result;
  for (const fs::path& file : text.files) {
    if (is_cpp(file)) continue;
    Arguments arguments{host, "-std=gnu11", "-funsigned-char", "-fshort-enums", "-DF_CPU=8000000"};
    for (const std::string& flag : define_flags(options.defines)) arguments.push_back(flag);
    arguments.insert(arguments.end(), kUsual.begin(), kUsual.end());
    for (const std::string& flag : kilolib_flags(kilolib, runtime)) arguments.push_back(flag);
    arguments.insert(arguments.end(), {"-isystem", (runtime / "kilolib").string()});
    append_host_headers(arguments, host, runtime);
    arguments.push_back(file.string());
    for (const Diagnostic& found : diagnostics(run_compiler(arguments).errors)) {
      result.push_back(found.file + ':' + found.line + ':' + found.column + ": warning: " + readable(found.text) +
                       " [" + found.option + ']');
    }
  }
  return result;
}

}  // namespace

std::vector<std::string> program_warnings(const std::vector<fs::path>& sources, const std::string& sha256,
                                          const CompileOptions& options) {
  const fs::path cache = os::cache_directory(options.cache_directory);
  // Warnings name the sources as they are named here. The same program may lie elsewhere.
  std::string key = sha256 + (os::find_executable("avr-gcc").empty() ? "-host" : "-robot");
  for (const fs::path& source : sources) key += '\n' + source.string();
  const fs::path kept = cache / "warnings" / sha256_hex(key);
  std::vector<std::string> result;
  if (const auto known = os::read_if_there(kept)) {
    std::istringstream lines(*known);
    for (std::string line; std::getline(lines, line);) result.push_back(line);
    return result;
  }
  result = usual_warnings(sources, options);
  for (std::string& warning : robot_warnings(sources, options)) result.push_back(std::move(warning));
  std::string text;
  for (const std::string& warning : result) text += warning + '\n';
  std::error_code error;
  fs::create_directories(kept.parent_path(), error);
  os::write_file(kept, text);
  return result;
}

}  // namespace kilotwin::behaviours
