#include "clients/cli/identify/data_kinds.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <utility>
#include <vector>

#include "clients/cli/identify/film_data.hpp"
#include "clients/cli/identify/trajectory_data.hpp"
#include "clients/identify/bristle/identify_bristle.hpp"
#include "clients/identify/data/import.hpp"
#include "clients/identify/kilogrid/floor_protocol.hpp"
#include "clients/identify/kilogrid/identify_floor.hpp"
#include "clients/identify/radio/radio_study.hpp"
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

bool has_tracks(const fs::path& data) {
  return identify::has_trajectories(data) || !identify::importable(data).empty() || !films_of(data).empty();
}

std::unique_ptr<identify::Study> read_floor(const DataPlaces& places, const identify::Options& options) {
  std::vector<kilogrid::FloorRun> held_out;
  if (!places.test.empty()) held_out = kilogrid::read_floor_runs(places.test);
  // Beside the days that are reported.
  const fs::path opened_days = (places.test.empty() ? places.train : places.test) / kilogrid::OpenedDays::kFile;
  return kilogrid::floor_study(kilogrid::read_floor_runs(places.train), std::move(held_out), options, opened_days);
}

std::unique_ptr<identify::Study> read_bristle(const DataPlaces& places, const identify::Options& options) {
  std::vector<bristle::BristleRun> held_out;
  if (!places.test.empty()) held_out = bristle::read_bristle_runs(places.test);
  return bristle::bristle_study(bristle::read_bristle_runs(places.train), std::move(held_out), options);
}

std::unique_ptr<identify::Study> read_radio(const DataPlaces& places, const identify::Options& options) {
  return radio_fit::radio_study({places.train, places.test}, {}, places.out / "radio", options);
}

/// In the order in which they are recognised: the columns of a recording include those of a Kilogrid run.
constexpr std::array<DataKind, 4> kDataKinds = {
    {{"trajectories", has_tracks, read_tracks, true},
     {"Kilogrid runs", kilogrid::has_floor_runs, read_floor, false},
     {"bristle plate tracks", bristle::has_bristle_runs, read_bristle, false},
     {"radio counts (comm_tau*_run*.dat)", radio_fit::has_radio_runs, read_radio, false}}};

}  // namespace

const DataKind& kind_of_data(const std::string& option, const fs::path& data) {
  std::error_code ignored;
  if (!fs::exists(data, ignored))
    throw UserError(
        fmt::format("{} {}: does not exist; expected a directory that holds {}", option, data.string(), kExpected));
  if (!fs::is_directory(data, ignored))
    throw UserError(fmt::format(
        "{} {}: is a file{}; expected a directory that holds {}", option, data.string(),
        data.extension() == ".csv" ? fmt::format(" with the columns \"{}\"", columns_of(data)) : "", kExpected));
  for (const DataKind& kind : kDataKinds) {
    if (kind.holds(data)) return kind;
  }
  if (fs::exists(data / "recording.ktrec", ignored)) {
    throw UserError(
        fmt::format("{} {}: is a run; write its poses into a directory of data first: kilotwin export {} "
                    "--trajectories DIR/FILE.csv",
                    option, data.string(), data.string()));
  }
  throw UserError(
      fmt::format("{} {}: {}; expected {}, or ARK logs (*.tsv, *.txt, *.log), or files of kilotwin "
                  "export --trajectories, or tables of kilotwin track, or films; state the columns of other tables "
                  "with --columns",
                  option, data.string(), contents_of(data), kExpected));
}

const DataKind& kind_of_tables() { return kDataKinds.front(); }

}  // namespace kilotwin::cli
