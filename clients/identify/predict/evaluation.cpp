#include "clients/identify/predict/evaluation.hpp"

#include <algorithm>
#include <array>

namespace kilotwin::identify {
namespace {

/// Runs from which on the last of them are held out, else robots from which on some are. With fewer of both, the second of
/// two runs is held out, or nothing.
constexpr std::size_t kRunsToHoldOut = 3, kRobotsToHoldOut = 4;
/// Runs, or robots, of which one is held out. A larger value leaves more to the fit, less to the choice and the reported error.
constexpr std::size_t kHeldOutOneIn = 4;

HeldOut held_out_of(const MeasuredSet& train, Tracks of) {
  const auto held = [](const Track& track) { return track.held_out; };
  bool any = false, whole_runs = true;
  for (const Run& run : train.runs) {
    const auto count = std::count_if(run.tracks.begin(), run.tracks.end(), held);
    any = any || std::any_of(run.tracks.begin(), run.tracks.end(), [&](const Track& t) { return counts(t, of); });
    whole_runs = whole_runs && (count == 0 || count == static_cast<std::ptrdiff_t>(run.tracks.size()));
  }
  if (!any) return HeldOut::kNothing;
  return whole_runs ? HeldOut::kRuns : HeldOut::kRobots;
}

/// Lets every other held-out robot choose; without two robots, every other held-out track.
void divide_held_out(MeasuredSet& set) {
  // Held-out robots, or tracks, of which one chooses; a larger value leaves more to the reported error, less to the choice.
  constexpr std::size_t kChoosesOneIn = 2;
  std::vector<Track*> held;
  std::vector<std::uint32_t> robots;
  for (Run& run : set.runs)
    for (Track& track : run.tracks)
      if (track.held_out) held.push_back(&track), robots.push_back(track.robot);
  std::sort(robots.begin(), robots.end());
  robots.erase(std::unique(robots.begin(), robots.end()), robots.end());
  for (std::size_t i = 0; i < held.size(); ++i) {
    const auto place = std::lower_bound(robots.begin(), robots.end(), held[i]->robot) - robots.begin();
    const std::size_t number = robots.size() >= kChoosesOneIn ? static_cast<std::size_t>(place) : i;
    held[i]->chooses = number % kChoosesOneIn == kChoosesOneIn - 1;
  }
}

}  // namespace

const char* name_of(HeldOut held_out) {
  constexpr std::array kNames = {"test set", "runs", "robots", "nothing", "no predicted time"};
  return kNames[static_cast<std::size_t>(held_out)];
}

std::string in_words(HeldOut held_out) {
  switch (held_out) {
    case HeldOut::kTestSet:
      return "Errors refer to the data of --test, which took no part in the fit or in the choice of the model.";
    case HeldOut::kRuns: return "Errors refer to tracks of the last runs, which took no part in the fit.";
    case HeldOut::kRobots: return "Errors refer to robots that took no part in the fit.";
    case HeldOut::kNoTime:
      return "No held-out track was measured both near a predicted time (10, 15, 20... s) and before, so the "
             "prediction "
             "error is unknown, and no effect is confirmed. Give longer runs, sampled once per second or more "
             "often.";
    case HeldOut::kNothing: break;
  }
  return "Nothing is held out, so the prediction error is unknown, and no effect is confirmed. Give a second run, "
         "or four "
         "robots, or other data with --test.";
}

void hold_out_part(MeasuredSet& set) {
  if (set.runs.size() >= kRunsToHoldOut) {
    const std::size_t keep = set.runs.size() - std::max<std::size_t>(1, set.runs.size() / kHeldOutOneIn);
    for (std::size_t r = keep; r < set.runs.size(); ++r)
      for (Track& track : set.runs[r].tracks) track.held_out = true;
    return divide_held_out(set);
  }
  const std::vector<std::uint32_t> robots = set.robots();
  for (Run& run : set.runs) {
    for (Track& track : run.tracks) {
      const auto place = std::lower_bound(robots.begin(), robots.end(), track.robot) - robots.begin();
      track.held_out = robots.size() >= kRobotsToHoldOut
                           ? static_cast<std::size_t>(place) % kHeldOutOneIn == kHeldOutOneIn - 1
                           : set.runs.size() == 2 && &run == &set.runs.back();
    }
  }
  divide_held_out(set);
}

void hold_out_for_choice(MeasuredSet& set) {
  // Robots, or tracks, of which one chooses; a larger value leaves more to the fit, less to the choice.
  constexpr std::size_t kOneIn = 5;
  if (set.tracks() < kOneIn) return;
  const std::vector<std::uint32_t> robots = set.robots();
  // Few robots: the tracks in their order.
  const bool by_robot = robots.size() >= kOneIn;
  std::size_t next = 0;
  for (std::size_t r = 0; r < set.runs.size(); ++r) {
    for (Track& track : set.runs[r].tracks) {
      const auto place = std::lower_bound(robots.begin(), robots.end(), track.robot) - robots.begin();
      const std::size_t number = by_robot ? static_cast<std::size_t>(place) + r : next++;
      track.held_out = track.chooses = number % kOneIn == kOneIn - 1;
    }
  }
}

Evaluation::Evaluation(const MeasuredSet& train, const MeasuredSet* test, Tracks of, std::uint32_t threads)
    : train_(train),
      test_(test),
      of_(test != nullptr ? Tracks::kAll : of),
      threads_(threads),
      held_out_(test != nullptr ? HeldOut::kTestSet : held_out_of(train, of)) {
  // Run numbers of both sets must not overlap.
  if (test != nullptr) test_tracks_.emplace(*test, static_cast<std::uint32_t>(train.runs.size()));
}

PreparedSet Evaluation::tracks_of(const FitState& state) const {
  PreparedSet tracks = test_tracks_ ? *test_tracks_ : state.tracks;
  tracks.set_command_lag(state.model.base.command_lag_s);
  if (test_tracks_) tracks.find_centres(state.model, threads_);
  tracks.find_headings(state.model, threads_);
  return tracks;
}

Judged Evaluation::judge(const FitState& state, const ForecastTimes& times) const {
  Judged out{tracks_of(state), {}, {}};
  if (held_out_ == HeldOut::kNothing) return out;
  out.forecasts = forecast(state.model, out.tracks, times, of_, threads_);
  out.errors = errors_of(set(), out.forecasts);
  return out;
}

}  // namespace kilotwin::identify
