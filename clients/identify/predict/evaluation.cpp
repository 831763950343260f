#include "clients/identify/predict/evaluation.hpp"

#include <algorithm>
#include <array>

namespace kilotwin::identify {
namespace {

constexpr std::size_t kRunsToHoldOut = 3, kRobotsToHoldOut = 4;

HeldOut held_out_of(const MeasuredSet& train) {
  const auto held = [](const Track& track) { return track.held_out; };
  bool any = false, whole_runs = true;
  for (const Run& run : train.runs) {
    const auto count = std::count_if(run.tracks.begin(), run.tracks.end(), held);
    any = any || count > 0;
    whole_runs = whole_runs && (count == 0 || count == static_cast<std::ptrdiff_t>(run.tracks.size()));
  }
  if (!any) return HeldOut::kNothing;
  return whole_runs ? HeldOut::kRuns : HeldOut::kRobots;
}

}  // namespace

const char* name_of(HeldOut held_out) {
  constexpr std::array kNames = {"test set", "runs", "robots", "nothing", "no predicted time"};
  return kNames[static_cast<std::size_t>(held_out)];
}

std::string in_words(HeldOut held_out) {
  switch (held_out) {
    case HeldOut::kTestSet: return "Errors refer to the data of --test, which took no part in the fit.";
    case HeldOut::kRuns: return "Errors refer to the last runs, which took no part in the fit.";
    case HeldOut::kRobots: return "Errors refer to one robot in four, which took no part in the fit.";
    case HeldOut::kNoTime:
      return "No held-out track was measured both at a predicted time (10, 15, 20... s) and before, so the "
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
    const std::size_t keep = set.runs.size() - std::max<std::size_t>(1, set.runs.size() / 4);
    for (std::size_t r = keep; r < set.runs.size(); ++r)
      for (Track& track : set.runs[r].tracks) track.held_out = true;
    return;
  }
  const std::vector<std::uint32_t> robots = set.robots();
  for (Run& run : set.runs) {
    for (Track& track : run.tracks) {
      const auto place = std::lower_bound(robots.begin(), robots.end(), track.robot) - robots.begin();
      track.held_out =
          robots.size() >= kRobotsToHoldOut ? place % 4 == 3 : set.runs.size() == 2 && &run == &set.runs.back();
    }
  }
}

Evaluation::Evaluation(const MeasuredSet& train, const MeasuredSet* test, std::uint32_t threads)
    : train_(train),
      test_(test),
      threads_(threads),
      held_out_(test != nullptr ? HeldOut::kTestSet : held_out_of(train)) {
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
  out.forecasts = forecast(state.model, out.tracks, times, marked_only(), threads_);
  out.errors = errors_of(set(), out.forecasts);
  return out;
}

}  // namespace kilotwin::identify
