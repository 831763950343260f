#include "services/behaviours/program_text.hpp"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <map>
#include <optional>
#include <regex>
#include <string_view>
#include <system_error>

#include "core/base/error.hpp"
#include "core/os/files.hpp"
#include "services/behaviours/runtime_files.hpp"
#include "services/behaviours/sha256.hpp"

namespace kilotwin::behaviours {
namespace fs = std::filesystem;
namespace {

/// Headers of kilolib and of its copies in simulators. A file of such a name is a copy if it contains one of the words.
struct Vendored {
  const char* name;
  std::vector<const char*> words;
};
const std::vector<Vendored>& vendored_headers() {
  static const std::vector<Vendored> kHeaders{{"kilolib.h", {"kilo_ticks"}},
                                              {"kilombo.h", {"REGISTER_USERDATA"}},
                                              {"message.h", {"calibmsg_t", "BOOTPGM_PAGE"}},
                                              {"message_crc.h", {"message_crc"}},
                                              {"message_buffered.h", {"rxbuffer"}},
                                              {"ringbuffer.h", {"RB_pushback"}},
                                              {"debug.h", {"debug_init", "debug_info_create"}},
                                              {"jansson.h", {"json_object"}},
                                              {"params.h", {"get_int_param"}}};
  return kHeaders;
}

/// Whether a file is a source of kilolib or of a simulator's version of it, which the runtime replaces.
bool is_kilolib_source(const fs::path& path, const std::string& text) {
  const std::string name = path.filename().string();
  if (name == "message_crc.c") return text.find("message_crc") != std::string::npos;
  if (name != "kilolib.c" && name != "kbapi.c" && name != "skilobot.c" && name != "kilolib.cpp") return false;
  static const std::regex kDefinition(R"(\bvoid\s+kilo_start\s*\([^;{]*\{)");
  return std::regex_search(text, kDefinition) || name == "skilobot.c";
}

struct Include {
  std::size_t begin, end;  ///< range of "NAME" or <NAME>, delimiters included
  std::string name;
  bool quoted;
};

std::vector<Include> includes_of(const std::string& text) {
  std::vector<Include> result;
  std::size_t line = 0;
  while (line < text.size()) {
    std::size_t end = text.find('\n', line);
    if (end == std::string::npos) end = text.size();
    std::size_t at = text.find_first_not_of(" \t", line);
    if (at < end && text[at] == '#') {
      at = text.find_first_not_of(" \t", at + 1);
      if (at < end && text.compare(at, 7, "include") == 0) {
        at = text.find_first_not_of(" \t", at + 7);
        if (at < end && (text[at] == '"' || text[at] == '<')) {
          const std::size_t close = text.find(text[at] == '"' ? '"' : '>', at + 1);
          if (close < end) result.push_back({at, close + 1, text.substr(at + 1, close - at - 1), text[at] == '"'});
        }
      }
    }
    line = end + 1;
  }
  return result;
}

/// The text without comments and with empty string literals, for searches.
std::string code_of(const std::string& text) {
  std::string code;
  code.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text.compare(i, 2, "//") == 0) {
      i = text.find('\n', i);
      if (i == std::string::npos) break;
      code += '\n';
    } else if (text.compare(i, 2, "/*") == 0) {
      i = text.find("*/", i + 2);
      if (i == std::string::npos) break;
      ++i;
      code += ' ';
    } else if (text[i] == '"') {
      for (++i; i < text.size() && text[i] != '"' && text[i] != '\n'; ++i) i += text[i] == '\\';
      code += "\"\"";
    } else {
      code += text[i];
    }
  }
  return code;
}

fs::path normal(const fs::path& path) {
  std::error_code error;
  const fs::path absolute = fs::absolute(path, error);
  return (error ? path : absolute).lexically_normal();
}

bool is_file(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

/// Files below a folder, at most three levels deep, in the order of their names.
std::vector<fs::path> files_below(const fs::path& folder) {
  constexpr std::size_t kMost = 4000;
  std::vector<fs::path> result;
  std::error_code error;
  for (fs::recursive_directory_iterator at(folder, fs::directory_options::skip_permission_denied, error), end;
       !error && at != end && result.size() < kMost; at.increment(error)) {
    const bool hidden = at->path().filename().string().starts_with('.');
    std::error_code kind;
    if (at->is_directory(kind)) {
      if (hidden || at.depth() >= 3 || at->is_symlink(kind)) at.disable_recursion_pending();
    } else if (!hidden) {
      result.push_back(at->path());
    }
  }
  std::sort(result.begin(), result.end());
  return result;
}

/// Whether a folder looks like the top of a repository.
bool is_top(const fs::path& folder) {
  std::error_code error;
  for (const char* name :
       {".git", "README.md", "README", "README.txt", "Readme.md", "readme.md", "LICENSE", "LICENSE.md"}) {
    if (fs::exists(folder / name, error)) return true;
  }
  return false;
}

/// Whether a folder is a home directory or a parent of one, which is too wide to search.
bool is_wide(const fs::path& folder) {
  const char* const home = std::getenv("HOME");  // NOLINT(concurrency-mt-unsafe): nothing here changes it
  return std::distance(folder.begin(), folder.end()) < 3 || folder.parent_path() == "/home" ||
         (home != nullptr && folder == fs::path(home));
}

/// Folders to search around a file: its own, up to two above it, and further ones up to the repository's top if there is one.
std::vector<fs::path> folders_around(const fs::path& file) {
  constexpr std::size_t kSurely = 3, kMost = 8;
  std::vector<fs::path> result;
  std::size_t used = 0;
  for (fs::path folder = normal(file).parent_path(); result.size() < kMost && !is_wide(folder);
       folder = folder.parent_path()) {
    result.push_back(folder);
    if (result.size() <= kSurely || is_top(folder)) used = result.size();
    if (fs::exists(folder / ".git")) break;
  }
  result.resize(used);
  if (result.empty()) result.push_back(normal(file).parent_path());
  return result;
}

struct FoundHeader {
  fs::path path;
  std::vector<fs::path> others;  ///< of the same name, in the same folder or below it
};

/// files_below(), which lists each folder once.
class Listings {
 public:
  const std::vector<fs::path>& files_below(const fs::path& folder) {
    const auto [listing, is_new] = known_.try_emplace(folder);
    if (is_new) listing->second = behaviours::files_below(folder);
    return listing->second;
  }

 private:
  std::map<fs::path, std::vector<fs::path>> known_;
};

/// Finds a header that a makefile's -I would find, or nothing. Of several the nearest: the one with the shortest path from the
/// file that includes it.
std::optional<FoundHeader> header_around(const fs::path& includer, const std::string& name, Listings& listings) {
  const fs::path from = normal(includer).parent_path();
  const auto steps = [&](const fs::path& to) {
    const fs::path way = to.lexically_relative(from);
    return std::distance(way.begin(), way.end());
  };
  for (const fs::path& folder : folders_around(includer)) {
    std::vector<fs::path> candidates;
    for (const fs::path& file : listings.files_below(folder)) {
      if (file.native().ends_with("/" + name)) candidates.push_back(file);
    }
    if (candidates.empty()) continue;
    std::stable_sort(candidates.begin(), candidates.end(),
                     [&](const fs::path& a, const fs::path& b) { return steps(a) < steps(b); });
    return FoundHeader{candidates.front(), {candidates.begin() + 1, candidates.end()}};
  }
  return std::nullopt;
}

class Preparation {
 public:
  Preparation(ProgramText& result, fs::path cache, Kilolib kilolib)
      : result_(result), cache_(std::move(cache)), kilolib_(kilolib) {}

  /// The file to compile: `file` itself, or a copy with changed #include lines.
  fs::path prepared(const fs::path& file) {
    const fs::path key = normal(file);
    if (const auto known = done_.find(key); known != done_.end()) return known->second;
    done_.emplace(key, file);  // ends the recursion for headers that include each other
    const auto text = os::read_if_there(file);
    if (!text) return file;
    std::vector<std::pair<Include, std::string>> changes, fixed;
    for (const Include& include : includes_of(*text)) {
      const std::string target = replacement(file, include);
      if (!target.empty())
        changes.emplace_back(include, target);
      else if (include.quoted && is_file(key.parent_path() / include.name))
        fixed.emplace_back(include, '"' + (key.parent_path() / include.name).lexically_normal().string() + '"');
    }
    if (changes.empty()) return file;
    changes.insert(changes.end(), fixed.begin(), fixed.end());
    std::sort(changes.begin(), changes.end(),
              [](const auto& a, const auto& b) { return a.first.begin < b.first.begin; });
    std::string copy = "#line 1 \"" + quotable(file) + "\"\n";
    std::size_t at = 0;
    for (const auto& [include, target] : changes) {
      copy.append(*text, at, include.begin - at).append(target);
      at = include.end;
    }
    copy.append(*text, at);
    const fs::path kept = cache_ / "sources" / (sha256_hex(copy) + file.extension().string());
    std::error_code error;
    fs::create_directories(kept.parent_path(), error);
    if (!is_file(kept)) os::write_file(kept, copy);
    return done_[key] = kept;
  }

  void note(const std::string& text) {
    if (std::find(result_.notes.begin(), result_.notes.end(), text) == result_.notes.end())
      result_.notes.push_back(text);
  }

 private:
  static std::string quotable(const fs::path& file) {
    std::string result;
    for (const char c : file.string()) {
      if (c == '"' || c == '\\') result += '\\';
      result += c;
    }
    return result;
  }

  /// The new target of an #include, or "" to keep it.
  std::string replacement(const fs::path& file, const Include& include) {
    const fs::path named(include.name);
    const std::string base = named.filename().string();
    const fs::path target = (normal(file).parent_path() / named).lexically_normal();
    const bool there = include.quoted && is_file(target);
    for (const Vendored& header : vendored_headers()) {
      if (base != header.name) continue;
      if (!there) return named.has_parent_path() && !include.name.starts_with("argos3/") ? "<" + base + ">" : "";
      const std::string text = os::read_if_there(target).value_or("");
      for (const char* word : header.words) {
        if (text.find(word) == std::string::npos) continue;
        note((file.parent_path() / named).lexically_normal().string() +
             ": left aside; programs are compiled with Kilotwin's own " + base);
        return "<" + base + ">";
      }
    }
    if (there) {
      result_.included.insert(target);
      const fs::path copy = prepared((file.parent_path() / named).lexically_normal());
      return normal(copy) == target ? "" : '"' + copy.string() + '"';
    }
    if (is_runtime_header(include.name)) return "";
    const std::optional<FoundHeader> found = header_around(file, named.lexically_normal().string(), listings_);
    if (!found) return "";
    std::string text = found->path.string() + ": found for #include " +
                       (include.quoted ? '"' + include.name + '"' : '<' + include.name + '>');
    if (!found->others.empty())
      text += "; the nearest of " + std::to_string(found->others.size() + 1) + ", another is " +
              found->others.front().string();
    note(text);
    result_.included.insert(found->path);
    return '"' + fs::absolute(prepared(found->path)).string() + '"';
  }

  /// Whether a header is found by the compiler's search path: in the runtime or among the compiler's own.
  [[nodiscard]] bool is_runtime_header(const std::string& name) const {
    static const std::set<std::string> kCompilers{"stdbool.h", "stddef.h", "stdarg.h",
                                                  "float.h",   "iso646.h", "stdalign.h"};
    const auto files = runtime_files();
    return kCompilers.contains(name) || std::any_of(files.begin(), files.end(), [&](const RuntimeFile& file) {
             return file.name == "libc/" + name || file.name == "kilolib/" + name ||
                    (kilolib_ != Kilolib::kKilobot && file.name == "kilogrid/" + name);
           });
  }

  ProgramText& result_;
  fs::path cache_;
  Kilolib kilolib_;
  Listings listings_;
  std::map<fs::path, fs::path> done_;
};

}  // namespace

bool is_cpp(const fs::path& source) {
  const std::string extension = source.extension().string();
  return extension == ".cpp" || extension == ".cc" || extension == ".cxx" || extension == ".C";
}

namespace {

/// A header of the Kilogrid's kilolib: a copy of it beside a program says nothing about the program.
bool is_kilogrid_header(const std::string& name) {
  const auto files = runtime_files();
  return std::any_of(files.begin(), files.end(),
                     [&](const RuntimeFile& file) { return file.name == "kilogrid/" + name; });
}

Kilolib kilolib_of_file(const fs::path& file, std::set<fs::path>& searched) {
  static const std::regex kModule(R"(\bmodule_(init|start)\s*\()"), kMessage(R"(\bIR_message_t\b)");
  if (!searched.insert(file.lexically_normal()).second) return Kilolib::kKilobot;
  const std::string text = os::read_if_there(file).value_or("");
  // Most programs mention neither, and std::regex is slow.
  if (text.find("module_") != std::string::npos && std::regex_search(code_of(text), kModule))
    return Kilolib::kKilogridModule;
  const bool has_message =
      text.find("IR_message_t") != std::string::npos && std::regex_search(code_of(text), kMessage);
  Kilolib result = has_message ? Kilolib::kKilogridRobot : Kilolib::kKilobot;
  for (const Include& include : includes_of(text)) {
    const std::string name = fs::path(include.name).filename().string();
    if (name.starts_with("kilob_") || name == "kilo_rand_lib.h") result = Kilolib::kKilogridRobot;
    if (!include.quoted || is_kilogrid_header(name)) continue;
    const Kilolib shown = kilolib_of_file(file.parent_path() / include.name, searched);
    if (shown == Kilolib::kKilogridModule) return shown;
    if (shown != Kilolib::kKilobot) result = shown;
  }
  return result;
}

}  // namespace

Kilolib kilolib_of(const std::vector<fs::path>& sources) {
  Kilolib result = Kilolib::kKilobot;
  std::set<fs::path> searched;
  for (const fs::path& source : sources) {
    const Kilolib shown = kilolib_of_file(source, searched);
    if (shown == Kilolib::kKilogridModule) return shown;
    if (shown != Kilolib::kKilobot) result = shown;
  }
  return result;
}

ProgramText program_text(const std::vector<fs::path>& sources, const fs::path& cache, Kilolib kilolib) {
  ProgramText result;
  Preparation preparation(result, cache, kilolib);
  for (const fs::path& source : sources) {
    if (sources.size() > 1 && is_kilolib_source(source, os::read_if_there(source).value_or(""))) {
      preparation.note(source.string() + ": left aside; programs are linked with Kilotwin's own kilolib");
      continue;
    }
    result.sources.push_back(source);
    result.files.push_back(preparation.prepared(source));
  }
  if (result.sources.empty())
    throw UserError(sources.front().string() + ": a copy of kilolib alone; name the program's own files");
  return result;
}

namespace {

/// The names that a text defines: functions with a body, and variables at the beginning of a line. Declarations do not count.
std::set<std::string> defined_names(const std::string& code, const std::set<std::string>& names) {
  std::set<std::string> result;
  for (const std::string& name : names) {
    if (code.find(name) == std::string::npos) continue;
    const std::regex definition("(^|\\n)[A-Za-z_][^;{}()#]*\\b" + name + "\\s*(\\([^;{}]*\\)\\s*\\{|=|\\[|;)");
    const std::regex elsewhere("(^|\\n)\\s*(extern|static)\\b[^;{}()]*\\b" + name + "\\b");
    if (std::regex_search(code, definition) && !std::regex_search(code, elsewhere)) result.insert(name);
  }
  return result;
}

/// Further source files around a program, in order: those named like an included header, those beside its sources, those in folders
/// around it.
std::vector<fs::path> sources_around(const ProgramText& text) {
  std::set<std::string> stems;
  for (const fs::path& header : text.included) stems.insert(header.stem().string());
  std::set<fs::path> taken(text.included.begin(), text.included.end());
  for (const fs::path& source : text.sources) taken.insert(normal(source));
  std::vector<fs::path> result, others;
  for (const fs::path& source : text.sources) {
    for (const fs::path& folder : folders_around(source)) {
      for (const fs::path& file : files_below(folder)) {
        if ((file.extension() != ".c" && !is_cpp(file)) || !taken.insert(normal(file)).second) continue;
        (stems.contains(file.stem().string()) ? result : others).push_back(file);
      }
    }
  }
  result.insert(result.end(), others.begin(), others.end());
  return result;
}

}  // namespace

std::string files_around(const ProgramText& text) {
  std::string result;
  for (const fs::path& file : sources_around(text)) {
    std::error_code error;
    result += file.string() + '\t' + std::to_string(fs::file_size(file, error)) + '\t' +
              std::to_string(fs::last_write_time(file, error).time_since_epoch().count()) + '\n';
  }
  return result;
}

std::vector<fs::path> sources_with(const std::set<std::string>& missing, const ProgramText& text,
                                   const std::function<std::string(const fs::path&)>& preprocessed) {
  static const std::regex kMain(R"(\bmain\s*\()");
  constexpr std::size_t kMostOctets = 200'000;  // std::regex overflows the stack on larger texts
  std::set<std::string> open;
  for (const std::string& name : missing) {
    // For a C++ name, take the last part if it is a word.
    const std::string last = name.substr(name.rfind(':') == std::string::npos ? 0 : name.rfind(':') + 1);
    if (std::all_of(last.begin(), last.end(), [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; }) &&
        !last.empty())
      open.insert(last);
  }
  std::vector<fs::path> result, without;
  auto take = [&](const fs::path& candidate, const std::string& code) {
    const std::set<std::string> found = defined_names(code, open);
    for (const std::string& name : found) open.erase(name);
    if (!found.empty()) result.push_back(fs::relative(candidate));
    return !found.empty();
  };
  for (const fs::path& candidate : sources_around(text)) {
    if (open.empty()) break;
    const std::string original = os::read_if_there(candidate).value_or("");
    if (original.size() > kMostOctets || is_kilolib_source(candidate, original)) continue;
    const std::string code = code_of(original);
    if (!std::regex_search(code, kMain) && !take(candidate, code)) without.push_back(candidate);
  }
  if (!result.empty()) return result;
  // Names that macros assemble appear only in preprocessed text. Of files of another language they would be other names.
  std::erase_if(without, [&](const fs::path& file) { return is_cpp(file) != is_cpp(text.sources.front()); });
  constexpr std::size_t kMostFiles = 100;
  if (without.size() > kMostFiles) without.resize(kMostFiles);
  for (const fs::path& candidate : without) {
    if (open.empty()) break;
    const std::string code = code_of(preprocessed(candidate));
    if (code.size() <= kMostOctets) take(candidate, code);
  }
  return result;
}

}  // namespace kilotwin::behaviours
