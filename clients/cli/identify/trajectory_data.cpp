#include "clients/cli/identify/trajectory_data.hpp"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "clients/identify/data/data_faults.hpp"
#include "clients/identify/data/import.hpp"
#include "clients/identify/data/plausibility.hpp"
#include "clients/identify/document.hpp"
#include "clients/identify/predict/evaluation.hpp"

namespace kilotwin::cli {
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

}  // namespace

identify::Identified identify_trajectories(const std::filesystem::path& train_directory,
                                           const std::filesystem::path& test_directory,
                                           const std::filesystem::path& out, const identify::Options& options) {
  const std::filesystem::path imported_test = out / "imported-test";
  // A track without a number must not look like a robot of the test set.
  const std::uint32_t first_number =
      test_directory.empty() ? 0 : identify::first_number_beside(train_directory, test_directory, imported_test);
  identify::MeasuredSet train = identify::load_or_import(train_directory, out / "imported-train", first_number);
  identify::demand_plausible(train, train_directory.string());
  options.progress({"checking for faults of the data", "", stats::Work::kSame});
  // No robot can produce these samples: they are excluded before the fit.
  std::vector<identify::DataFault> faults = identify::exclude_faults(train);
  std::optional<identify::MeasuredSet> test;
  if (!test_directory.empty()) {
    test = identify::load_or_import(test_directory, imported_test, train.robots().back() + 1);
    identify::demand_plausible(*test, test_directory.string());
    identify::demand_longer_than(*test, options.horizon_s, false, test_directory.string());
    identify::hold_out_for_choice(train);
    add_test_faults(*test, faults);
  } else {
    identify::hold_out_part(train);
    identify::demand_longer_than(train, options.horizon_s, has_held_out_track(train), train_directory.string());
  }
  identify::Identified found = identify::identify(train, test ? &*test : nullptr, options);
  identify::add_faults(*found.found.mutable_result(), faults);
  return found;
}

}  // namespace kilotwin::cli
