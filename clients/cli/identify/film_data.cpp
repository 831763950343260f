#include "clients/cli/identify/film_data.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include "clients/cli/other_program.hpp"
#include "clients/identify/data/measured_set.hpp"
#include "core/base/error.hpp"
#include "core/os/files.hpp"
#include "core/os/process.hpp"

namespace kilotwin::cli {
namespace fs = std::filesystem;
namespace {

constexpr std::array<std::string_view, 5> kFilms = {".mp4", ".mkv", ".avi", ".mov", ".webm"};

bool is_film(const fs::path& file) {
  return std::find(kFilms.begin(), kFilms.end(), file.extension().string()) != kFilms.end();
}

/// The last line that is not empty: of a program that failed, the reason.
std::string last_line(std::string_view text) {
  while (text.ends_with('\n')) text.remove_suffix(1);
  return std::string(text.substr(text.rfind('\n') + 1));
}

std::vector<std::string> tracking(const fs::path& film, const fs::path& table) {
  std::vector<std::string> words{
      program_beside("kilotwin-vision").string(), "track", film.string(), "--out", table.string(), "--quiet"};
  for (const char* name : {"camera.yaml", "camera.xml"}) {
    const fs::path calibration = film.parent_path() / name;
    if (!fs::exists(calibration)) continue;
    words.insert(words.end(), {"--calibration", calibration.string()});
    break;
  }
  return words;
}

}  // namespace

std::vector<fs::path> films_of(const fs::path& directory) {
  std::vector<fs::path> films;
  if (identify::has_trajectories(directory)) return films;
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(directory, ignored))
    if (entry.is_regular_file(ignored) && is_film(entry.path())) films.push_back(entry.path());
  std::sort(films.begin(), films.end());
  return films;
}

void track_films(const fs::path& directory, const fs::path& to, const identify::Options& options) {
  fs::create_directories(to);
  for (const fs::path& film : films_of(directory)) {
    const fs::path table = to / (film.stem().string() + ".csv");
    if (fs::exists(table))
      throw UserError(fmt::format("{}: names the same run as another film; rename one", film.string()));
    if (options.progress) options.progress({"tracking", film.filename().string(), stats::Work::kSame});
    const os::ProcessResult result = os::run_process(tracking(film, table));
    if (!result.end.well())
      throw RunError(fmt::format("{}: cannot be tracked: {}", film.string(), last_line(result.errors)));
  }
  for (const char* name : {"commands.csv", "commands.csv.gz"})
    if (fs::exists(directory / name)) os::write_file(to / name, os::read_file(directory / name));
}

}  // namespace kilotwin::cli
