#include "clients/monitor/monitor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "core/base/error.hpp"
#include "core/base/ids.hpp"
#include "core/plan/motion_settings.hpp"
#include "core/plan/run_settings.hpp"
#include "core/plan/tracking_settings.hpp"
#include "idl/recording.pb.h"

namespace kilotwin::monitor {
namespace {

/// Least standard deviation of a bias that is not stated, and of one that is, mm/s.
constexpr double kLeastBias_mm_s = 0.2;
/// Slow change of biases that every robot is granted, mm^2/s^3: 0.2 mm/s within an hour of driving.
constexpr double kBiasGrowth_mm2_s3 = 1e-5;
/// A bias that a warm-up finds so many standard deviations from its prior is none.
constexpr double kUnusualBias = 5;
/// Contacts are sought every so many ticks.
constexpr std::int64_t kContactsEvery = 4;
std::vector<std::uint32_t> tracked_robots(const RunPlan& plan) {
  std::vector<std::uint32_t> robots;
  for (std::uint32_t robot = 0; robot < plan.robots(); ++robot) {
    if (plan.tracked(robot)) robots.push_back(robot);
  }
  return robots;
}

/// Robots whose commands nothing else tells.
std::vector<bool> commanded_by_station(const RunPlan& plan, const MonitorSettings& settings,
                                       const CommandTable& declared) {
  std::vector<bool> robots(plan.robots(), false);
  for (std::uint32_t robot = 0; robot < plan.robots() && !settings.station_commands.empty(); ++robot) {
    robots[robot] = plan.tracked(robot) && plan.program_of(robot) == kNoProgram && !declared.has(robot);
    if (robots[robot] && plan.uid_of(robot) != robot)
      throw UserError(
          fmt::format("--station-commands: robot {} has the id {} in messages; number robots from first_uid: 0, or "
                      "declare its commands with --commands FILE",
                      robot, plan.uid_of(robot)));
  }
  return robots;
}

std::vector<std::uint32_t> watched_robots(const RunPlan& plan, const CommandTable& declared,
                                          const std::vector<bool>& by_station) {
  for (const std::uint32_t robot : declared.robots()) {
    if (robot >= plan.robots() || !plan.tracked(robot)) {
      throw UserError(
          fmt::format("--commands: robot {} is no tracked robot of this experiment; give commands of "
                      "robots in groups with body: TRACKED",
                      robot));
    }
  }
  std::vector<std::uint32_t> robots = tracked_robots(plan);
  std::erase_if(robots, [&](std::uint32_t robot) {
    return plan.program_of(robot) == kNoProgram && !declared.has(robot) && !by_station[robot];
  });
  if (robots.empty()) {
    throw UserError(
        "--monitor: no tracked robot has known commands; give its group `says { shadow: true }` and a behaviour, "
        "or "
        "declare the commands with --commands FILE, or give the types of the station's motion messages by "
        "--station-commands");
  }
  return robots;
}

BiasPrior prior_of(const RunPlan& plan, std::uint32_t robot, const BiasNoise& slow) {
  const MotionSettings& motion = plan.motion_settings();
  BiasPrior prior{motion.bias_mean_mm_s, motion.bias_mean_mm_s, std::max(motion.bias_sd_mm_s, kLeastBias_mm_s),
                  kBiasGrowth_mm2_s3 + slow.growth_mm2_s3};
  for (const RobotSettings& known : plan.robot_settings()) {
    if (known.robot != robot || !known.bias_left_mm_s || !known.bias_right_mm_s) continue;
    prior.left_mm_s = *known.bias_left_mm_s;
    prior.right_mm_s = *known.bias_right_mm_s;
    prior.sd_mm_s = std::max(motion.bias_sd_mm_s / 4, kLeastBias_mm_s);
  }
  prior.sd_mm_s = __builtin_sqrt(prior.sd_mm_s * prior.sd_mm_s + slow.variance_mm2_s2);
  return prior;
}

}  // namespace

Monitor::Monitor(const RunPlan& plan, const MonitorSettings& settings, CommandTable declared)
    : plan_(plan),
      settings_(settings),
      declared_(std::move(declared)),
      commanded_by_station_(commanded_by_station(plan, settings, declared_)),
      parameters_(plan),
      motors_(plan),
      tracked_(tracked_robots(plan)),
      watched_(watched_robots(plan, declared_, commanded_by_station_)),
      motion_(plan, watched_),
      contacts_(plan, tracked_),
      places_(plan.world.arena.half_width_mm(), plan.world.arena.half_height_mm()),
      trackers_(static_cast<std::uint32_t>(std::max<std::size_t>(1, plan.tracking_settings().trackers.size()))),
      wheel_base_mm_(plan.motion_settings().wheel_base_mm),
      notes_(watched_.size()),
      entry_of_(plan.robots(), -1),
      duties_(plan.robots()),
      residuals_(watched_) {
  const BiasNoise slow = bias_noise(plan);
  const Geometry geometry{wheel_base_mm_, plan.motion_settings().axle_offset_mm};
  for (std::uint32_t i = 0; i < watched_.size(); ++i) {
    entry_of_[watched_[i]] = static_cast<std::int32_t>(i);
    const auto at = std::lower_bound(tracked_.begin(), tracked_.end(), watched_[i]) - tracked_.begin();
    tracked_entry_.push_back(static_cast<std::uint32_t>(at));
    robots_.emplace_back(watched_[i], WatchedRobot::Setting{geometry, prior_of(plan, watched_[i], slow), settings_,
                                                            plan.tick_length.cycles(), trackers_});
  }
  // Half of the false alarms may come from each grid. Tests per start: of each robot its lasting hypotheses and its visit to a
  // place, of the arena gain and drift; of each robot jump and heading, of each tracker its shift.
  const auto robots = static_cast<double>(watched_.size());
  const auto lasting = static_cast<double>(
      std::count_if(robot_hypotheses().begin(), robot_hypotheses().end(),
                    [](const Hypothesis& hypothesis) { return family_of(hypothesis.group) == Family::kLasting; }));
  const double absorbed = static_cast<double>(robot_hypotheses().size()) - lasting;
  const double rate = settings_.false_alarms_per_hour / 2, tick_s = plan.tick_length.seconds();
  threshold_nat_ = threshold_nat(robots * (lasting + 1) + 2, static_cast<double>(coarse_.every()) * tick_s, rate);
  shift_threshold_nat_ =
      threshold_nat(robots * absorbed + trackers_, static_cast<double>(fine_.every()) * tick_s, rate);
}

void Monitor::take(const proto::EventRecord& packets) {
  for (const SentCommand& sent : commands_in(packets, settings_.station_commands)) {
    if (sent.robot >= plan_.robots() || !commanded_by_station_[sent.robot]) continue;
    const double offset_s = static_cast<double>(sent.offset_cycles) / kNominalClockHz;
    declared_.add(sent.robot, seconds(Tick{packets.tick()}) + offset_s, sent.command);
  }
}

void Monitor::read_commands(const SwarmView& swarm) {
  const double now_s = seconds(swarm.tick);
  for (std::uint32_t robot = 0; robot < plan_.robots(); ++robot) {
    duties_[robot] = declared_.has(robot)
                         ? duties_of(declared_.at(robot, now_s), parameters_.calibration(robot))
                         : motors_.acting(swarm.motor_left[robot], swarm.motor_right[robot], swarm.spin_up[robot]);
  }
  for (std::size_t i = 0; i < watched_.size(); ++i) {
    const std::uint32_t robot = watched_[i];
    const LifeCycle life = LifeCycle{swarm.life_cycle[robot]};
    const bool is_unknown = life == LifeCycle::kFailed || life == LifeCycle::kFlat;
    // Before the station's first message nobody knows what the robot does.
    const bool is_uncommanded = commanded_by_station_[robot] && !declared_.has(robot);
    if (life == LifeCycle::kAbsent || (is_unknown && !declared_.has(robot)) || is_uncommanded) robots_[i].lose();
  }
}

void Monitor::advance(const SwarmView& swarm) {
  read_commands(swarm);
  motion_.advance(swarm, duties_);
  for (std::size_t i = 0; i < robots_.size(); ++i) robots_[i].add_motion(swarm.tick, motion_.motion()[i]);
  if (swarm.tick.count() % kContactsEvery == 0) {
    contacts_.update(swarm);
    const std::int64_t cycle = swarm.tick.count() * plan_.tick_length.cycles();
    for (std::size_t i = 0; i < robots_.size(); ++i) {
      const std::uint32_t robot = watched_[i];
      const bool in_patch = places_.is_known(swarm.x_mm[robot], swarm.y_mm[robot]);
      if (in_patch || contacts_.touches(tracked_entry_[i])) robots_[i].disturb(cycle);
    }
  }
  if (const auto slot = coarse_.advance(swarm.tick)) {
    for (WatchedRobot& robot : robots_) robot.clear_slot(Family::kLasting, *slot);
  }
  if (const auto slot = fine_.advance(swarm.tick)) {
    for (WatchedRobot& robot : robots_) robot.clear_slot(Family::kAbsorbed, *slot);
  }
  residuals_.advance(seconds(swarm.tick));
  process_samples(swarm);
  evaluate(swarm.tick);
}

void Monitor::process_samples(const SwarmView& swarm) {
  const std::int64_t known_until = (swarm.tick.count() + 1) * plan_.tick_length.cycles();
  std::stable_sort(waiting_.begin(), waiting_.end(), [](const TrackerSample& a, const TrackerSample& b) {
    return a.capture_cycle < b.capture_cycle;
  });
  std::size_t done = 0;
  for (; done < waiting_.size() && waiting_[done].capture_cycle <= known_until; ++done)
    process(waiting_[done], swarm);
  waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(done));
}

void Monitor::process(const TrackerSample& sample, const SwarmView& swarm) {
  const TrackerSettings tracker = tracker_of(plan_.tracking_settings(), sample.source);
  for (std::size_t n = 0; n < sample.robot.size(); ++n) {
    if (sample.robot[n] >= entry_of_.size() || entry_of_[sample.robot[n]] < 0) continue;
    const auto state = TrackedState{sample.state[n]};
    if (state != TrackedState::kSeen && state != TrackedState::kInDoubt) continue;
    if (LifeCycle{swarm.life_cycle[sample.robot[n]]} == LifeCycle::kAbsent) continue;
    const auto i = static_cast<std::size_t>(entry_of_[sample.robot[n]]);
    WatchedRobot& robot = robots_[i];
    const auto innovation =
        robot.measure(measured_pose(tracker, sample, n), std::min(sample.source, trackers_ - 1), dispersion_);
    if (!innovation) continue;
    ++totals_.samples;
    totals_.outliers += innovation->is_outlier ? 1u : 0u;
    residuals_.add(i, *innovation, robot.counts());
    if (robot.counts()) {
      for (std::size_t d = 0; d < innovation->dimensions; ++d) {
        white_sum_[d] += innovation->white[d];
        white_squares_[d] += innovation->white[d] * innovation->white[d];
        white_count_[d] += 1;
      }
      if (on_innovation) on_innovation(robot, *innovation);
    }
    const double time_s = static_cast<double>(sample.capture_cycle) / kNominalClockHz;
    if (robot.take_first_warm()) check_bias(i, time_s);
    visit(i, time_s);
  }
}

void Monitor::visit(std::size_t i, double time_s) {
  WatchedRobot& robot = robots_[i];
  Notes& notes = notes_[i];
  if (!robot.is_tested() || !robot.counts()) return end_visit(i);
  const std::uint32_t cell = places_.cell_of(robot.filter().x_mm(), robot.filter().y_mm());
  const bool is_over =
      notes.is_at_place && (cell != notes.cell || time_s - notes.visit.from_s > Places::kLongestVisit_s);
  if (is_over) end_visit(i);
  if (!notes.is_at_place) {
    robot.place().clear();
    notes.is_at_place = true;
    notes.cell = cell;
    notes.visit = {robot.id(), time_s, time_s, 0, 0, 0, 0};
    notes.weight = 0;
  }
  notes.visit.to_s = time_s;
  notes.visit.x_mm += robot.filter().x_mm();
  notes.visit.y_mm += robot.filter().y_mm();
  notes.weight += 1;
  notes.visit.score = robot.place().score();
  notes.visit.information = robot.place().information();
}

void Monitor::end_visit(std::size_t i) {
  Notes& notes = notes_[i];
  if (!std::exchange(notes.is_at_place, false) || notes.weight == 0) return;
  notes.visit.x_mm /= notes.weight;
  notes.visit.y_mm /= notes.weight;
  if (const auto patch = places_.add(notes.cell, notes.visit, dispersion_.of(Group::kGain), threshold_nat_))
    alarm_of_patch(*patch, notes.visit.to_s);
}

/// A robot that was faulty from the start has shown no change; its bias tells.
void Monitor::check_bias(std::size_t i, double time_s) {
  const RobotFilter& filter = robots_[i].filter();
  const BiasPrior& prior = filter.prior();
  const auto check = [&](Suspect suspect, double bias, double mean, Eigen::Index entry) {
    const double deviation = (bias - mean) / prior.sd_mm_s;
    if (deviation * deviation < kUnusualBias * kUnusualBias) return;
    Alarm alarm;
    alarm.time_s = time_s;
    alarm.onset_s = 0;
    alarm.suspect = suspect;
    alarm.robots = {robots_[i].id()};
    alarm.x_mm = filter.x_mm();
    alarm.y_mm = filter.y_mm();
    alarm.sizes = {{bias, __builtin_sqrt(filter.covariance()(entry, entry))}};
    alarm.evidence_nat = deviation * deviation / 2;
    alarm.threshold_nat = kUnusualBias * kUnusualBias / 2;
    alarms_.push_back(alarm);
  };
  check(Suspect::kBiasLeft, filter.bias_left_mm_s(), prior.left_mm_s, 3);
  check(Suspect::kBiasRight, filter.bias_right_mm_s(), prior.right_mm_s, 4);
}

Totals Monitor::totals() const {
  Totals totals = totals_;
  totals.robots_watched = static_cast<std::uint32_t>(watched_.size());
  totals.robots_tracked = static_cast<std::uint32_t>(tracked_.size());
  for (const WatchedRobot& robot : robots_) totals.tested_robot_hours += robot.tested_s() / 3600;
  totals.threshold_nat = threshold_nat_;
  totals.shift_threshold_nat = shift_threshold_nat_;
  for (std::size_t g = 0; g < totals.dispersion.size(); ++g)
    totals.dispersion[g] = dispersion_.of(static_cast<Group>(g));
  for (std::size_t d = 0; d < 3; ++d) {
    if (white_count_[d] == 0) continue;
    totals.white_mean[d] = white_sum_[d] / white_count_[d];
    totals.white_variance[d] = white_squares_[d] / white_count_[d] - totals.white_mean[d] * totals.white_mean[d];
  }
  return totals;
}

}  // namespace kilotwin::monitor
