#include "clients/cli/identify/trajectory_data.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "clients/cli/identify/film_data.hpp"
#include "clients/identify/data/data_faults.hpp"
#include "clients/identify/data/import.hpp"
#include "clients/identify/data/plausibility.hpp"
#include "clients/identify/predict/evaluation.hpp"
#include "core/base/error.hpp"

namespace kilotwin::cli {
namespace fs = std::filesystem;
namespace {

bool has_held_out_track(const identify::MeasuredSet& set) {
  return std::any_of(set.runs.begin(), set.runs.end(), [](const identify::Run& run) {
    return std::any_of(run.tracks.begin(), run.tracks.end(), [](const identify::Track& t) { return t.held_out; });
  });
}

/// Faults of the test data are excluded from nothing: each row is predicted.
void add_test_faults(const identify::MeasuredSet& test, std::vector<identify::DataFault>& faults) {
  identify::MeasuredSet copy = test;
  for (identify::DataFault& fault : identify::exclude_faults(copy)) {
    fault.of_test = true;
    faults.push_back(std::move(fault));
  }
}

/// The stated format, with what a directory itself tells: its tables may have the columns of trajectories.csv.
identify::TableFormat format_in(const fs::path& directory, identify::TableFormat format) {
  if (format.run.empty() && identify::has_trajectories(directory)) format.run = "run";
  if (format.heading.empty() && identify::has_headings(directory)) format.heading = "heading_rad";
  if (format.heading.empty() && format.degrees)
    throw UserError(
        fmt::format("--angle deg: {} has no column heading_rad; name the column of headings: "
                    "--columns heading=NAME",
                    directory.string()));
  return format;
}

/// The directory, or that of the tables of its films, if it holds nothing else.
fs::path tracked(const fs::path& directory, const fs::path& tables, const identify::Options& options) {
  if (directory.empty() || films_of(directory).empty() || !identify::importable(directory).empty())
    return directory;
  track_films(directory, tables, options);
  return tables;
}

/// One of the two sets. `first_number`: of tracks without one.
identify::MeasuredSet read(const DataPlaces& places, const fs::path& directory, const char* imported,
                           std::uint32_t first_number) {
  identify::MeasuredSet set = places.format ? identify::read_tables(directory, format_in(directory, *places.format))
                                            : identify::load_or_import(directory, first_number);
  if (places.format || !identify::has_trajectories(directory)) save_measured_set(set, places.out / imported);
  identify::demand_plausible(set, directory.string());
  return set;
}

}  // namespace

std::unique_ptr<identify::Study> read_tracks(const DataPlaces& given, const identify::Options& options) {
  DataPlaces places = given;
  // Tables whose format is stated count, not films beside them.
  if (!places.format) {
    places.train = tracked(places.train, places.out / "tracked-train", options);
    places.test = tracked(places.test, places.out / "tracked-test", options);
  }
  const bool has_test = !places.test.empty();
  // A track without a number must not look like a robot of the test set.
  const std::uint32_t first_number =
      has_test && !places.format ? identify::first_number_beside(places.train, places.test) : 0;
  identify::MeasuredSet train = read(places, places.train, "imported-train", first_number);
  if (options.progress) options.progress({"checking for faults of the data", "", stats::Work::kSame});
  // No robot can produce these samples: they are excluded before the fit.
  std::vector<identify::DataFault> faults = identify::exclude_faults(train);
  std::optional<identify::MeasuredSet> test;
  if (has_test) {
    test = read(places, places.test, "imported-test", train.robots().back() + 1);
    identify::demand_longer_than(*test, options.horizon_s, false, places.test.string());
    identify::hold_out_for_choice(train);
    add_test_faults(*test, faults);
  } else {
    identify::hold_out_part(train);
    identify::demand_longer_than(train, options.horizon_s, has_held_out_track(train), places.train.string());
  }
  return identify::track_study(std::move(train), std::move(test), std::move(faults), options);
}

}  // namespace kilotwin::cli
