/// The residual monitor: compares tracked robots with the current model while a run lasts, and raises an alarm when a robot, a
/// tracker or the arena leaves it. docs/explanation/monitor.md has the method.
///
/// It reads the run's samples and states and changes nothing. Equal inputs give equal alarms: a replay of a recording raises
/// those of the run.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "clients/monitor/alarm.hpp"
#include "clients/monitor/command_table.hpp"
#include "clients/monitor/commanded_motion.hpp"
#include "clients/monitor/contacts.hpp"
#include "clients/monitor/places.hpp"
#include "clients/monitor/residuals.hpp"
#include "clients/monitor/settings.hpp"
#include "clients/monitor/start_grid.hpp"
#include "clients/monitor/watched_robot.hpp"
#include "core/frames/swarm_view.hpp"
#include "core/frames/tracker_sample.hpp"

namespace kilotwin::monitor {

struct Totals {
  std::uint32_t robots_watched = 0, robots_tracked = 0;
  double tested_robot_hours = 0;                      ///< after warm-ups
  std::uint64_t samples = 0;                          ///< measurements of single robots that were compared
  std::uint64_t outliers = 0;                         ///< beyond the gate
  double threshold_nat = 0, shift_threshold_nat = 0;  ///< of lasting effects; of shifts and jumps
  std::array<double, static_cast<std::size_t>(Group::kCount)> dispersion{};
  std::array<double, 3> white_mean{}, white_variance{};  ///< of the innovations along, across and of the heading
};

class Monitor {
 public:
  /// Watches tracked robots that have a program of their own, their shadow, or declared commands. Throws UserError if there are
  /// none, or if commands are declared for robots that are not tracked.
  Monitor(const RunPlan& plan, const MonitorSettings& settings, CommandTable declared);

  /// A sample that was stamped for the tick of the next state.
  void take(const TrackerSample& sample) { waiting_.push_back(sample); }
  /// Packets of the station, as events record them; before the state of the next tick.
  void take(const proto::EventRecord& packets);
  /// The swarm at a tick, with what programs have set for the step from there. Ticks ascend by one.
  void advance(const SwarmView& swarm);
  /// The alarms since the last call, in order.
  [[nodiscard]] std::vector<Alarm> take_alarms() { return std::exchange(alarms_, {}); }
  /// The residuals of whole seconds since the last call, by time, then robot.
  [[nodiscard]] std::vector<Residual> take_residuals() { return residuals_.take(); }
  [[nodiscard]] Totals totals() const;

  /// Gets every innovation of a robot that is not disturbed; for tests and measurements.
  std::function<void(const WatchedRobot&, const Innovation&)> on_innovation;

 private:
  struct Found {
    const Hypothesis* hypothesis = nullptr;
    double evidence = 0;
    double excess = 0;  ///< of the evidence over its threshold
    std::size_t slot = 0;
    Sums sums;
    std::uint32_t tracker = 0;
  };
  /// State of a robot beside its filter.
  struct Notes {
    std::uint32_t above = 0;  ///< evaluations in a row with an evidence above the threshold
    std::uint32_t cell = 0;
    Visit visit;
    double weight = 0;  ///< samples of the visit
    bool is_at_place = false;
  };

  void read_commands(const SwarmView& swarm);
  void process_samples(const SwarmView& swarm);
  void process(const TrackerSample& sample, const SwarmView& swarm);
  void visit(std::size_t i, double time_s);
  void end_visit(std::size_t i);
  void check_bias(std::size_t i, double time_s);
  void evaluate(Tick now);
  [[nodiscard]] bool evaluate_arena(Tick now);
  void evaluate_robot(std::size_t i, Tick now);
  [[nodiscard]] bool may_alarm(const WatchedRobot& robot, Tick now) const;
  [[nodiscard]] const StartGrid& grid(const Hypothesis& hypothesis) const {
    return family_of(hypothesis.group) == Family::kLasting ? coarse_ : fine_;
  }
  [[nodiscard]] double threshold(const Hypothesis& hypothesis) const {
    return family_of(hypothesis.group) == Family::kLasting ? threshold_nat_ : shift_threshold_nat_;
  }
  [[nodiscard]] std::vector<Found> of_robot(const WatchedRobot& robot, Tick now) const;
  [[nodiscard]] Found best_of_arena(Tick now) const;
  [[nodiscard]] Sums arena_sums(const Hypothesis& hypothesis, std::uint32_t tracker, std::size_t slot) const;
  /// Whether a patch explains what the robot met; raises the patch's alarm.
  [[nodiscard]] bool met_patch(std::size_t i, const std::vector<Found>& found, Tick now);
  void alarm_of_robot(std::size_t i, const std::vector<Found>& found, Tick now);
  void alarm_of_arena(const Found& found, Tick now);
  void alarm_of_patch(const Places::Patch& patch, double time_s);
  [[nodiscard]] Alarm alarm_from(const Found& found, Tick now) const;
  [[nodiscard]] double dispersion(const Hypothesis& hypothesis) const { return dispersion_.of(hypothesis.group); }
  [[nodiscard]] double seconds(Tick tick) const { return plan_.tick_length.seconds_at(tick); }

  const RunPlan& plan_;
  const MonitorSettings settings_;
  CommandTable declared_;
  const std::vector<bool> commanded_by_station_;  ///< by robot
  const RobotParameters parameters_;
  const MotorRule motors_;
  std::vector<std::uint32_t> tracked_, watched_;  ///< ascending ids
  CommandedMotion motion_;
  Contacts contacts_;
  StartGrid coarse_{32, 3662};  ///< a start about every second, up to two minutes: of lasting effects
  StartGrid fine_{1, 14};       ///< one per tick, up to half a second: of effects that filters absorb
  Places places_;
  Dispersion dispersion_;
  std::uint32_t trackers_;
  double wheel_base_mm_;
  double threshold_nat_ = 0, shift_threshold_nat_ = 0;
  std::vector<WatchedRobot> robots_;          ///< per entry of watched_
  std::vector<Notes> notes_;                  ///< per entry of watched_
  std::vector<std::int32_t> entry_of_;        ///< by robot: entry of watched_, or -1
  std::vector<std::uint32_t> tracked_entry_;  ///< per entry of watched_: its entry in tracked_
  std::vector<Duties> duties_;                ///< of all robots
  std::vector<TrackerSample> waiting_;
  std::uint32_t arena_above_ = 0;
  std::vector<Alarm> alarms_;
  Residuals residuals_;
  Totals totals_;
  std::array<double, 3> white_sum_{}, white_squares_{}, white_count_{};
};

}  // namespace kilotwin::monitor
