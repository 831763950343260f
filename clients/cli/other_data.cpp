#include "clients/cli/other_data.hpp"

#include <fmt/format.h>

#include "clients/cli/radio_data.hpp"
#include "clients/identify/bristle/identify_bristle.hpp"
#include "clients/identify/data/import.hpp"
#include "clients/identify/kilogrid/identify_floor.hpp"
#include "core/base/error.hpp"

namespace kilotwin::cli {
namespace fs = std::filesystem;

std::optional<identify::Identified> identify_other_data(const fs::path& train, const fs::path& test,
                                                        const fs::path& out, const identify::Options& options) {
  // The columns of a recording include those of a Kilogrid run.
  if (identify::has_trajectories(train) || !identify::importable(train).empty()) return std::nullopt;
  const auto same_kind = [&](bool is, const char* kind) {
    if (!test.empty() && !is)
      throw UserError(fmt::format("--test {}: it does not hold {}, as --train does", test.string(), kind));
  };
  if (kilogrid::has_floor_runs(train)) {
    same_kind(test.empty() || kilogrid::has_floor_runs(test), "runs of a floor");
    return kilogrid::identify_floor(
        kilogrid::read_floor_runs(train),
        test.empty() ? std::vector<kilogrid::FloorRun>{} : kilogrid::read_floor_runs(test), options);
  }
  if (bristle::has_ridden_runs(train)) {
    same_kind(test.empty() || bristle::has_ridden_runs(test), "runs of robots that are always on");
    return bristle::identify_ridden(
        bristle::read_ridden_runs(train),
        test.empty() ? std::vector<bristle::RiddenRun>{} : bristle::read_ridden_runs(test), options);
  }
  if (has_radio_runs(train)) {
    same_kind(test.empty() || has_radio_runs(test), "runs of radio messages");
    return identify_radio_runs(train, test, out, options);
  }
  return std::nullopt;
}

}  // namespace kilotwin::cli
