#include "services/behaviours/companions.hpp"

#include <algorithm>
#include <sstream>
#include <system_error>

#include "core/base/error.hpp"
#include "core/os/files.hpp"
#include "services/behaviours/compiler_common.hpp"
#include "services/behaviours/sha256.hpp"

namespace kilotwin::behaviours {
namespace fs = std::filesystem;
namespace {

/// The result of an earlier search for a program: a file in the cache. Its first line is the state of the program and of the files
/// around it then; each further line is the path of a source.
class SearchResult {
 public:
  SearchResult(const std::vector<fs::path>& given, const fs::path& cache, const Making& making)
      : given_(given), cache_(cache), kilolib_(making.kilolib) {
    std::string key = making.kind + '\n';
    std::error_code error;
    for (const fs::path& source : given) key += fs::absolute(source, error).lexically_normal().string() + '\n';
    file_ = cache / "searches" / sha256_hex(key);
  }

  /// The sources that were found; none where there was no search, or where the program or a file around it has changed since.
  [[nodiscard]] std::vector<fs::path> found() const {
    std::istringstream lines(os::read_if_there(file_).value_or(""));
    std::string line;
    if (!std::getline(lines, line)) return {};
    const std::string then = line;
    std::vector<fs::path> result;
    while (std::getline(lines, line)) result.push_back(fs::relative(line));
    return then == state(result) ? result : std::vector<fs::path>{};
  }

  void keep(const std::vector<fs::path>& found) const {
    std::string all = state(found) + '\n';
    for (const fs::path& source : found) all += fs::absolute(source).string() + '\n';
    std::error_code error;
    fs::create_directories(file_.parent_path(), error);
    os::write_file(file_, all);
  }

 private:
  /// The files around the program, and the texts of which it is made. A program that no longer needs a companion has another text.
  [[nodiscard]] std::string state(const std::vector<fs::path>& found) const {
    std::vector<fs::path> sources = given_;
    sources.insert(sources.end(), found.begin(), found.end());
    const ProgramText text = program_text(sources, cache_, kilolib_);
    std::string all = files_around(program_text(given_, cache_, kilolib_));
    const auto add = [&](const fs::path& file) { all += sha256_hex(os::read_if_there(file).value_or("")) + '\n'; };
    std::for_each(text.sources.begin(), text.sources.end(), add);
    std::for_each(text.included.begin(), text.included.end(), add);
    return sha256_hex(all);
  }

  const std::vector<fs::path>& given_;
  const fs::path& cache_;
  Kilolib kilolib_;
  fs::path file_;
};

std::string with_notes(std::string errors, const std::vector<std::string>& notes) {
  for (const std::string& note : notes) errors += "\nnote: " + note;
  return errors;
}

}  // namespace

CompiledProgram with_companions(const std::vector<fs::path>& given, const fs::path& cache, const Making& making) {
  const SearchResult earlier(given, cache, making);
  std::vector<fs::path> found = earlier.found();
  bool searched = false;
  for (;;) {
    std::vector<fs::path> sources = given;
    sources.insert(sources.end(), found.begin(), found.end());
    const ProgramText text = program_text(sources, cache, making.kilolib);
    try {
      CompiledProgram program = making.make(text);
      if (searched) earlier.keep(found);
      program.sources = text.sources;
      program.notes = kilolib_notes(making.kilolib, text.sources.front());
      program.notes.insert(program.notes.end(), text.notes.begin(), text.notes.end());
      for (const fs::path& source : found)
        program.notes.push_back(source.string() + ": compiled too; it has what the program lacks");
      return program;
    } catch (const UserError& error) {
      if (searched || found.empty()) throw UserError(with_notes(error.what(), text.notes));
      found.clear();  // what was found then no longer fits
      searched = true;
    } catch (const Incomplete& incomplete) {
      searched = true;
      const std::vector<fs::path> more =
          sources_with(undefined_names(incomplete.errors), text, making.preprocessed);
      if (more.empty()) throw UserError(with_notes(all_errors(incomplete.errors, text.sources), text.notes));
      found.insert(found.end(), more.begin(), more.end());
    }
  }
}

}  // namespace kilotwin::behaviours
