#include "clients/cli/identify/other_data.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <vector>

#include "clients/cli/identify/radio_data.hpp"
#include "clients/identify/bristle/identify_bristle.hpp"
#include "clients/identify/data/import.hpp"
#include "clients/identify/kilogrid/identify_floor.hpp"
#include "core/base/error.hpp"

namespace kilotwin::cli {
namespace fs = std::filesystem;
namespace {

constexpr const char* kExpected =
    "trajectories.csv or trajectories.csv.gz with the columns run,robot,time_s,x_mm,y_mm[,heading_rad]";

/// The first line of a table, as a reader would recognise it.
std::string columns_of(const fs::path& csv) {
  constexpr std::size_t kMost = 80;
  std::ifstream stream(csv);
  std::string line;
  std::getline(stream, line);
  while (line.ends_with('\r')) line.pop_back();
  for (char& c : line) {
    if (static_cast<unsigned char>(c) < ' ') c = '?';
  }
  if (line.size() > kMost) line = line.substr(0, kMost) + "...";
  return line;
}

std::string file_in_words(const fs::path& file) {
  const std::string name = file.filename().string();
  return file.extension() == ".csv" ? fmt::format("{} with the columns \"{}\"", name, columns_of(file)) : name;
}

/// The first entries of a directory, tables with their columns.
std::string contents_of(const fs::path& directory) {
  constexpr std::size_t kMost = 3;
  std::vector<fs::path> entries;
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(directory, ignored))
    entries.push_back(entry.path());
  if (entries.empty()) return "is an empty directory";
  std::sort(entries.begin(), entries.end());
  std::string text = "holds ";
  for (std::size_t i = 0; i < std::min(entries.size(), kMost); ++i)
    text += (i > 0 ? ", " : "") + file_in_words(entries[i]);
  if (entries.size() > kMost) text += fmt::format(" and {} more", entries.size() - kMost);
  return text;
}

}  // namespace

void demand_known_data(const std::string& option, const fs::path& data) {
  std::error_code ignored;
  if (!fs::exists(data, ignored))
    throw UserError(
        fmt::format("{} {}: does not exist; expected a directory that holds {}", option, data.string(), kExpected));
  if (!fs::is_directory(data, ignored))
    throw UserError(fmt::format(
        "{} {}: is a file{}; expected a directory that holds {}", option, data.string(),
        data.extension() == ".csv" ? fmt::format(" with the columns \"{}\"", columns_of(data)) : "", kExpected));
  if (identify::has_trajectories(data) || !identify::importable(data).empty() || kilogrid::has_floor_runs(data) ||
      bristle::has_bristle_runs(data) || has_radio_runs(data))
    return;
  if (fs::exists(data / "recording.ktrec", ignored)) {
    throw UserError(
        fmt::format("{} {}: is a run; write its poses into a directory of data first: kilotwin export {} "
                    "--trajectories DIR/FILE.csv",
                    option, data.string(), data.string()));
  }
  throw UserError(
      fmt::format("{} {}: {}; expected {}, or ARK logs (*.tsv, *.txt, *.log), or files of kilotwin "
                  "export --trajectories",
                  option, data.string(), contents_of(data), kExpected));
}

std::optional<identify::Identified> identify_other_data(const fs::path& train, const fs::path& test,
                                                        const fs::path& out, const identify::Options& options) {
  // The columns of a recording include those of a Kilogrid run.
  if (identify::has_trajectories(train) || !identify::importable(train).empty()) return std::nullopt;
  if (options.draws > 0)
    throw UserError(fmt::format(
        "--draws: models are drawn from the posterior of a fit to trajectories, and {} holds other data",
        train.string()));
  const auto same_kind = [&](bool is, const char* kind) {
    if (!test.empty() && !is)
      throw UserError(
          fmt::format("--test {}: does not hold {}; give the same kind of data as --train", test.string(), kind));
  };
  if (kilogrid::has_floor_runs(train)) {
    same_kind(test.empty() || kilogrid::has_floor_runs(test), "Kilogrid runs");
    return kilogrid::identify_floor(
        kilogrid::read_floor_runs(train),
        test.empty() ? std::vector<kilogrid::FloorRun>{} : kilogrid::read_floor_runs(test), options);
  }
  if (bristle::has_bristle_runs(train)) {
    same_kind(test.empty() || bristle::has_bristle_runs(test), "bristle plate tracks");
    return bristle::identify_bristle(
        bristle::read_bristle_runs(train),
        test.empty() ? std::vector<bristle::BristleRun>{} : bristle::read_bristle_runs(test), options);
  }
  if (has_radio_runs(train)) {
    same_kind(test.empty() || has_radio_runs(test), "radio counts (comm_tau*_run*.dat)");
    return identify_radio_runs(train, test, out, options);
  }
  return std::nullopt;
}

}  // namespace kilotwin::cli
