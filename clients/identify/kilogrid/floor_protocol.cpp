#include "clients/identify/kilogrid/floor_protocol.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <sstream>
#include <utility>

#include "core/base/build_identity.hpp"
#include "core/base/error.hpp"
#include "core/base/state_hash.hpp"
#include "core/os/files.hpp"

namespace kilotwin::kilogrid {
namespace {

std::uint64_t hash_of(const FloorRun& run) {
  HashState hash(run.tracks.size());
  for (const FloorTrack& track : run.tracks) {
    hash.add(track.robot);
    for (const std::vector<double>* values : {&track.time_s, &track.x_mm, &track.y_mm})
      for (const double value : *values) hash.add(hash_bits(value));
  }
  return hash.finish();
}

/// Of all that a search depends on: the program, its options, and the days.
std::uint64_t hash_of_search(const std::vector<const FloorRun*>& searched, const std::string& options) {
  HashState hash(hash_bytes(build_identity()));
  hash.add(hash_bytes(options));
  for (const FloorRun* const run : searched) hash.add(hash_of(*run));
  return hash.finish();
}

std::string hex(std::uint64_t hash) { return fmt::format("{:016x}", hash); }

}  // namespace

FloorDays divided(std::vector<FloorRun> train, std::vector<FloorRun> test) {
  constexpr std::size_t kFewest = 3;  // runs; with fewer, none is spared for the choice beside a test set
  FloorDays days;
  days.report = std::move(test);
  const bool has_test = !days.report.empty(), spare = train.size() >= kFewest;
  std::size_t held_out = 0;
  const std::size_t all = train.size(), all_held_out = all > 1 ? (all + 1) / 3 : 0;
  for (std::size_t r = 0; r < all; ++r) {
    const bool out = has_test ? spare && r % 4 == 2 : all > 1 && r % 3 == 1;
    std::vector<FloorRun>* to = &days.fit;
    if (out) to = has_test || (all_held_out > 1 && held_out++ % 2 == 1) ? &days.choose : &days.report;
    to->push_back(std::move(train[r]));
  }
  if (days.fit.empty() || days.report.empty() || days.fit.front().tracks.empty())
    throw UserError("one run cannot be held out; give at least two runs, or --test DIR");
  days.chose_on_reported = days.choose.empty();
  if (days.chose_on_reported) days.choose = days.report;
  return days;
}

std::vector<const FloorRun*> FloorDays::searched() const {
  std::vector<const FloorRun*> days;
  for (const std::vector<FloorRun>* part : {&fit, &choose})
    for (const FloorRun& run : *part) days.push_back(&run);
  return days;
}

std::size_t chosen_model(const std::vector<FloorScore>& path) {
  // Robots of a day differ: the error of those that are predicted is larger by two standard errors with a probability
  // of 2.3 %, by chance alone. Few robots have a large standard error: a model that is worse by more than kLargest is
  // not written, whatever the reason.
  constexpr double kSameMisfit = 0.02, kSameError = 0.01, kLargest = 0.05, kChance = 2;
  const auto eligible = [&](std::size_t k) {
    const FloorScore &model = path[k], &base = path[0];
    // Written so that a number that is none does not pass.
    const bool by_chance =
        model.rmse_mm <= base.rmse_mm * (1 + kLargest) && model.excess.mean_mm2 <= kChance * model.excess.se_mm2;
    const bool predicts = model.rmse_mm <= base.rmse_mm * (1 + kSameError) || by_chance;
    return k == 0 || (model.misfit < base.misfit && predicts);
  };
  double least = INFINITY;
  for (std::size_t k = 0; k < path.size(); ++k)
    if (eligible(k)) least = std::min(least, path[k].misfit);
  for (std::size_t k = 0; k < path.size(); ++k)
    if (eligible(k) && path[k].misfit <= least * (1 + kSameMisfit)) return k;
  return 0;
}

OpenedDays::Opened OpenedDays::open(const std::vector<FloorRun>& report,
                                    const std::vector<const FloorRun*>& searched, const std::string& options,
                                    const std::string& today) const {
  if (file_.empty()) return {};
  std::set<std::string> days, searches;
  for (const FloorRun& run : report) days.insert(hex(hash_of(run)));
  const std::string search = hex(hash_of_search(searched, options));
  Opened opened;
  std::error_code ignored;
  const std::optional<std::string> read = os::read_if_there(file_);
  if (!read && std::filesystem::exists(file_, ignored)) {
    opened.unwritable = file_.string() + " cannot be read";
    return opened;
  }
  std::string known = read.value_or("");
  if (!known.empty() && known.back() != '\n') known += '\n';
  std::istringstream lines(known);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string date, day, by;
    if (line.starts_with('#') || !(words >> date >> day >> by)) continue;
    if (days.contains(day)) searches.insert(by);
  }
  opened.before = searches.size() - searches.count(search);
  if (searches.contains(search)) return opened;
  std::string text =
      known.empty() ? "# date, hash of a day that was reported, hash of the search, name of the day\n" : known;
  for (const FloorRun& run : report)
    text += fmt::format("{} {} {} {}\n", today, hex(hash_of(run)), search, run.name);
  try {
    os::write_file(file_, text);
  } catch (const RunError& error) {
    opened.unwritable = error.what();
  }
  return opened;
}

}  // namespace kilotwin::kilogrid
