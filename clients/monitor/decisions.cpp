// The decisions of the monitor: which evidence is an alarm, and of what.
#include <algorithm>

#include "clients/monitor/monitor.hpp"
#include "core/plan/tracking_settings.hpp"

namespace kilotwin::monitor {
namespace {

/// A start is not judged before so many ticks.
constexpr std::int64_t kRipe = 3;

bool is_ripe(const StartGrid& grid, std::size_t slot, Tick now) {
  return grid.is_used(slot) && now - grid.begin(slot) >= kRipe;
}

/// The largest evidence of a hypothesis over ripe starts.
template <class SumsOf>
std::pair<double, std::size_t> largest(const Hypothesis& hypothesis, double dispersion, const StartGrid& grid,
                                       Tick now, SumsOf&& sums_of_slot) {
  std::pair<double, std::size_t> best{-1e300, 0};
  for (std::size_t slot = 0; slot < StartGrid::kSlots; ++slot) {
    if (!is_ripe(grid, slot, now)) continue;
    const Sums sums = sums_of_slot(slot);
    if (evidence_bound(sums, hypothesis.prior, dispersion) <= best.first) continue;
    best = std::max(best, {evidence(sums, hypothesis.prior, dispersion), slot});
  }
  return best;
}

/// Robots are evaluated every so many ticks, in turns.
constexpr std::int64_t kTurns = 4;
/// Evaluations in a row above the threshold before an alarm: of the arena every tick, of a robot every kTurns ticks. A single
/// wrong frame is no alarm.
constexpr std::uint32_t kConfirmArena = 3, kConfirmRobot = 2;
/// Hypotheses whose evidence is so much below the largest are named as well, nat.
constexpr double kAmbiguous_nat = 3;
/// A robot whose gain of both wheels has at most so much less evidence than another effect may be in a patch, nat.
constexpr double kPatchLike_nat = 6;

}  // namespace

void Monitor::evaluate(Tick now) {
  if (evaluate_arena(now)) return;
  for (std::size_t i = 0; i < robots_.size(); ++i) {
    if ((now.count() + static_cast<std::int64_t>(i)) % kTurns == 0) evaluate_robot(i, now);
  }
}

Sums Monitor::arena_sums(const Hypothesis& hypothesis, std::uint32_t tracker, std::size_t slot) const {
  Sums all;
  all.dimensions = 0;
  for (const WatchedRobot& robot : robots_) {
    if (!robot.is_tested()) continue;
    const Sums own = hypothesis.suspect == Suspect::kCalibrationShift
                         ? shift_sums(robot.signatures(), robot.signatures().shift_column(tracker), slot, 3)
                         : sums_of(hypothesis.suspect, robot.signatures(), slot, wheel_base_mm_);
    all += own;
    all.dimensions = own.dimensions;
  }
  return all;
}

Monitor::Found Monitor::best_of_arena(Tick now) const {
  Found best;
  best.excess = -1e300;
  const auto try_one = [&](const Hypothesis& hypothesis, std::uint32_t tracker) {
    const auto sums = [&](std::size_t slot) { return arena_sums(hypothesis, tracker, slot); };
    const auto [found, slot] = largest(hypothesis, dispersion(hypothesis), grid(hypothesis), now, sums);
    const double excess = found - threshold(hypothesis);
    if (excess > best.excess) best = {&hypothesis, found, excess, slot, sums(slot), tracker};
  };
  for (std::uint32_t tracker = 0; tracker < trackers_; ++tracker) try_one(calibration_shift(), tracker);
  try_one(gain_of_all(), 0);
  try_one(drift_of_all(), 0);
  return best;
}

bool Monitor::evaluate_arena(Tick now) {
  const auto tested =
      std::count_if(robots_.begin(), robots_.end(), [](const WatchedRobot& robot) { return robot.is_tested(); });
  if (tested < 2) return false;
  const Found found = best_of_arena(now);
  if (found.excess < 0) {
    arena_above_ = 0;
    return false;
  }
  // A single robot that leaves the model alone has more evidence for itself.
  for (const WatchedRobot& robot : robots_) {
    if (!robot.is_tested()) continue;
    for (const Found& own : of_robot(robot, now)) {
      if (own.excess >= found.excess) {
        arena_above_ = 0;
        return false;
      }
    }
  }
  if (++arena_above_ < kConfirmArena) return true;
  arena_above_ = 0;
  alarm_of_arena(found, now);
  return true;
}

std::vector<Monitor::Found> Monitor::of_robot(const WatchedRobot& robot, Tick now) const {
  std::vector<Found> found;
  for (const Hypothesis& hypothesis : robot_hypotheses()) {
    const auto sums = [&](std::size_t slot) {
      return sums_of(hypothesis.suspect, robot.signatures(), slot, wheel_base_mm_);
    };
    const auto [value, slot] = largest(hypothesis, dispersion(hypothesis), grid(hypothesis), now, sums);
    if (value > 0) found.push_back({&hypothesis, value, value - threshold(hypothesis), slot, sums(slot), 0});
  }
  std::stable_sort(found.begin(), found.end(), [](const Found& a, const Found& b) { return a.excess > b.excess; });
  return found;
}

bool Monitor::may_alarm(const WatchedRobot& robot, Tick now) const {
  for (const Hypothesis& hypothesis : robot_hypotheses()) {
    for (std::size_t slot = 0; slot < StartGrid::kSlots; ++slot) {
      if (!is_ripe(grid(hypothesis), slot, now)) continue;
      const Sums sums = sums_of(hypothesis.suspect, robot.signatures(), slot, wheel_base_mm_);
      if (evidence_bound(sums, hypothesis.prior, dispersion(hypothesis)) > threshold(hypothesis)) return true;
    }
  }
  return false;
}

void Monitor::evaluate_robot(std::size_t i, Tick now) {
  Notes& notes = notes_[i];
  if (!robots_[i].is_tested() || !may_alarm(robots_[i], now)) {
    notes.above = 0;
    return;
  }
  const std::vector<Found> found = of_robot(robots_[i], now);
  if (found.empty() || found.front().excess < 0) {
    notes.above = 0;
    return;
  }
  if (++notes.above < kConfirmRobot) return;
  notes.above = 0;
  // The robot's visit counts for the place first: several robots there have another cause than one robot.
  const std::size_t before = alarms_.size();
  end_visit(i);
  if (alarms_.size() > before) return;
  if (robots_[i].is_on_probation()) return robots_[i].relearn();
  if (!met_patch(i, found, now)) alarm_of_robot(i, found, now);
}

bool Monitor::met_patch(std::size_t i, const std::vector<Found>& found, Tick now) {
  const auto gain = std::find_if(found.begin(), found.end(),
                                 [](const Found& one) { return one.hypothesis->suspect == Suspect::kGain; });
  if (gain == found.end() || gain->excess < std::max(0.0, found.front().excess - kPatchLike_nat)) return false;
  WatchedRobot& robot = robots_[i];
  const double x_mm = robot.filter().x_mm(), y_mm = robot.filter().y_mm();
  if (places_.is_known(x_mm, y_mm, 2)) {
    places_.extend(x_mm, y_mm);
    robot.restart_tests();
    return true;
  }
  const Visit visit{robot.id(),
                    seconds(grid(*gain->hypothesis).begin(gain->slot)),
                    seconds(now),
                    x_mm,
                    y_mm,
                    gain->sums.score[0],
                    gain->sums.information[0]};
  const auto patch = places_.add_alarm(visit, dispersion(*gain->hypothesis));
  if (patch) alarm_of_patch(*patch, seconds(now));
  return patch.has_value();
}

Alarm Monitor::alarm_from(const Found& found, Tick now) const {
  Alarm alarm;
  alarm.time_s = seconds(now);
  alarm.onset_s = seconds(grid(*found.hypothesis).begin(found.slot));
  alarm.suspect = found.hypothesis->suspect;
  const auto all = sizes(found.sums, found.hypothesis->prior, dispersion(*found.hypothesis));
  alarm.sizes.assign(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(found.sums.dimensions));
  alarm.evidence_nat = found.evidence;
  alarm.threshold_nat = threshold(*found.hypothesis);
  return alarm;
}

void Monitor::alarm_of_robot(std::size_t i, const std::vector<Found>& found, Tick now) {
  WatchedRobot& robot = robots_[i];
  Alarm alarm = alarm_from(found.front(), now);
  alarm.robots = {robot.id()};
  alarm.x_mm = robot.filter().x_mm();
  alarm.y_mm = robot.filter().y_mm();
  for (std::size_t n = 1; n < found.size(); ++n) {
    if (found[n].excess > found.front().excess - kAmbiguous_nat)
      alarm.alternatives.push_back(found[n].hypothesis->suspect);
  }
  if (alarm.suspect == Suspect::kGain) alarm.alternatives.push_back(Suspect::kPatch);
  const auto tested =
      std::count_if(robots_.begin(), robots_.end(), [](const WatchedRobot& other) { return other.is_tested(); });
  if (alarm.suspect == Suspect::kJump && tested < 2) alarm.alternatives.push_back(Suspect::kCalibrationShift);
  const bool is_jump = alarm.suspect == Suspect::kJump;
  alarms_.push_back(std::move(alarm));
  if (is_jump)
    robot.restart_tests();
  else
    robot.hold();
}

void Monitor::alarm_of_arena(const Found& found, Tick now) {
  Alarm alarm = alarm_from(found, now);
  for (std::size_t i = 0; i < robots_.size(); ++i) {
    WatchedRobot& robot = robots_[i];
    if (!robot.is_tested()) continue;
    alarm.robots.push_back(robot.id());
    alarm.x_mm += robot.filter().x_mm();
    alarm.y_mm += robot.filter().y_mm();
    notes_[i].above = 0;
    notes_[i].is_at_place = false;
    if (alarm.suspect == Suspect::kGainOfAll)
      robot.relearn();
    else
      robot.restart_tests();
  }
  alarm.x_mm /= static_cast<double>(alarm.robots.size());
  alarm.y_mm /= static_cast<double>(alarm.robots.size());
  const auto& trackers = plan_.tracking_settings().trackers;
  if (alarm.suspect == Suspect::kCalibrationShift && found.tracker < trackers.size())
    alarm.tracker = trackers[found.tracker].source;
  places_.clear();
  alarms_.push_back(std::move(alarm));
}

void Monitor::alarm_of_patch(const Places::Patch& patch, double time_s) {
  Alarm alarm;
  alarm.time_s = time_s;
  alarm.onset_s = patch.onset_s;
  alarm.suspect = Suspect::kPatch;
  alarm.robots = patch.robots;
  alarm.x_mm = patch.x_mm;
  alarm.y_mm = patch.y_mm;
  alarm.sizes = {patch.size};
  alarm.evidence_nat = patch.evidence;
  alarm.threshold_nat = threshold_nat_;
  alarms_.push_back(std::move(alarm));
  for (WatchedRobot& robot : robots_) {
    // Robots that contributed may just be there: what their filters learned of them was the patch.
    if (std::binary_search(patch.robots.begin(), patch.robots.end(), robot.id()) && robot.is_tested())
      robot.restart_tests();
  }
}

}  // namespace kilotwin::monitor
