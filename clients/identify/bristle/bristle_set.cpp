#include "clients/identify/bristle/bristle_set.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "core/base/error.hpp"
#include "core/csv/csv_reader.hpp"

namespace kilotwin::bristle {
namespace fs = std::filesystem;
namespace {

constexpr const char* kColumns[] = {"run", "robot", "time_s", "x_mm", "y_mm", "heading_rad"};
/// Largest plausible speed, mm/s, slack per frame, and the gap after which any position is plausible.
constexpr double kFastest_mm_s = 700, kSlack_mm = 5, kForgotten_s = 1;

std::vector<fs::path> files_of(const fs::path& directory) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(directory, error)) {
    const std::string name = entry.path().filename().string();
    if (name.ends_with(".csv") || name.ends_with(".csv.gz")) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace

bool has_bristle_runs(const fs::path& directory) {
  const std::vector<fs::path> files = files_of(directory);
  for (const fs::path& file : files) {
    const std::string name = file.filename().string();
    if (name.starts_with("trajectories.") || name.starts_with("commands.")) return false;
    const CsvReader reader(file);
    for (const char* column : kColumns) {
      if (!reader.find_column(column)) return false;
    }
  }
  return !files.empty();
}

std::vector<BristleRun> read_bristle_runs(const fs::path& directory) {
  std::map<std::string, BristleRun> runs;
  for (const fs::path& file : files_of(directory)) {
    CsvReader reader(file);
    std::size_t at[6];
    for (std::size_t c = 0; c < 6; ++c) at[c] = reader.column(kColumns[c]);
    while (reader.next()) {
      BristleRun& run = runs[std::string(reader.text(at[0]))];
      run.robot = reader.whole(at[1]);
      const double time_s = reader.number(at[2]);
      if (!run.time_s.empty() && time_s <= run.time_s.back())
        reader.complain(at[2], "the time is not after that of the previous row; sort the rows of a run by time");
      run.time_s.push_back(time_s);
      run.x_mm.push_back(reader.number(at[3]));
      run.y_mm.push_back(reader.number(at[4]));
      run.heading_rad.push_back(reader.number(at[5]));
    }
  }
  std::vector<BristleRun> all;
  for (auto& [name, run] : runs) {
    run.name = name;
    drop_implausible_rows(run);
    all.push_back(std::move(run));
  }
  return all;
}

void drop_implausible_rows(BristleRun& run) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < run.size(); ++i) {
    if (kept > 0) {
      const double way_mm = std::hypot(run.x_mm[i] - run.x_mm[kept - 1], run.y_mm[i] - run.y_mm[kept - 1]);
      const double past_s = run.time_s[i] - run.time_s[kept - 1];
      if (past_s < kForgotten_s && way_mm > kFastest_mm_s * past_s + kSlack_mm) continue;
    }
    for (std::vector<double>* column : {&run.time_s, &run.x_mm, &run.y_mm, &run.heading_rad})
      (*column)[kept] = (*column)[i];
    ++kept;
  }
  run.dropped = run.size() - kept;
  for (std::vector<double>* column : {&run.time_s, &run.x_mm, &run.y_mm, &run.heading_rad}) column->resize(kept);
}

}  // namespace kilotwin::bristle
