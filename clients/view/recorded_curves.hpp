/// RecordedCurves: what the page can plot of a recording, as curves over time. A recording may still grow.
///
/// A curve has kMostPoints points at most, and reads so much of the file at most that a viewer never waits for long. Where there
/// are more states, it takes every second, fourth, eighth... of them. One answer reads for 40 ms at most; another call continues. The observables that the experiment names are evaluated for
/// these states; of a recording that grows, those that use variables end some seconds before its last state.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "clients/recorder/observables.hpp"
#include "clients/recorder/reader.hpp"
#include "clients/recorder/state_index.hpp"
#include "clients/recorder/swarm_observables.hpp"
#include "clients/recorder/variables_until.hpp"
#include "clients/view/curves.hpp"
#include "clients/view/residual_curves.hpp"

namespace kilotwin::view {

class RecordedCurves {
 public:
  /// All must outlive this object, and the caller calls it from one thread at a time. An expression that cannot be read is left
  /// out, with all others.
  RecordedCurves(recorder::Reader& reader, const recorder::StateIndex& index, ResidualCurves& residuals);

  /// A message of type "plots": what can be plotted, of the swarm and of single robots. Plots have numbers from 0.
  [[nodiscard]] std::string list() const;
  /// A message of type "plot". Of the swarm, variables have their mean, least and largest value. Where `whole` is false in it, it
  /// took too long to read all; another call continues. Empty: there is no such plot.
  [[nodiscard]] std::string plot(std::uint32_t number, std::optional<std::uint32_t> robot);
  /// A message of type "trail": where a robot was up to a tick. It is continued as a plot is.
  [[nodiscard]] std::string trail(std::uint32_t robot, std::int64_t tick);
  /// The last recorded value of a variable of a robot up to a tick; nothing where there is none.
  [[nodiscard]] std::optional<double> value(std::uint32_t variable, std::uint32_t robot, std::int64_t tick);

 private:
  using Clock = std::chrono::steady_clock;
  /// Numbers of the swarm per state: the observables of observables.hpp, and counts of robots.
  static constexpr std::size_t kCounts = 3, kNumbers = recorder::kObservables.size() + kCounts;

  struct Plot {
    std::string name, title, unit;
    bool of_swarm = true, of_robot = false;
    std::optional<std::uint32_t> variable, event;  ///< else a number of the swarm per state
    std::optional<std::size_t> own;                ///< an observable of the experiment
    std::size_t number = 0;                        ///< index of it
    bool residuals = false;                        ///< of the monitor
  };
  struct Answer {
    std::string text;
    std::size_t states = 0;  ///< that the recording had
    bool ended = false;      ///< it had its end
    Clock::time_point made;
  };
  /// Of one kind, of the swarm or of a robot: the number of events up to each record that was read.
  struct EventCounts {
    std::uint32_t kind = 0;
    std::optional<std::uint32_t> robot;
    std::vector<std::uint64_t> up_to;
  };

  /// Values that were read for one curve: up to three numbers, by number of the state or of the variable's tick.
  using Points = std::map<std::size_t, std::array<double, 3>>;
  enum class Curve : std::uint8_t { kPath, kTrail, kVariable };
  struct KnownPoints {
    Curve curve;
    std::uint32_t variable;              ///< of kVariable
    std::optional<std::uint32_t> robot;  ///< nothing: of the swarm
    Points at;
  };

  /// Calls take(number, entry) for each of the entries up to a tick that a curve needs and that `known` does not hold; forgets the
  /// others that it holds. `entry_bytes`: what it reads for one. False: it took too long, and another call continues.
  template <class Known, class Take>
  [[nodiscard]] bool each_new(Known& known, std::span<const recorder::StateIndex::Entry> all,
                              std::size_t entry_bytes, std::int64_t until_tick, const Take& take);
  /// The same for the first `count` states: take(number, state).
  template <class Known, class Take>
  [[nodiscard]] bool each_new_state(Known& known, std::size_t count, std::int64_t until_tick, const Take& take);
  [[nodiscard]] bool take_places(Points& points, std::uint32_t robot, std::size_t states);
  [[nodiscard]] Points& points_of(Curve curve, std::uint32_t variable, std::optional<std::uint32_t> robot);
  [[nodiscard]] std::array<double, 3> values_at(std::span<const recorder::StateIndex::Entry> of_tick,
                                                std::optional<std::uint32_t> robot);
  [[nodiscard]] bool take_states();
  [[nodiscard]] bool take_own();
  [[nodiscard]] Curves of_states(const Plot& plot);
  [[nodiscard]] Curves of_own(std::size_t number);
  [[nodiscard]] Curves of_displacement(std::uint32_t robot);
  [[nodiscard]] Curves of_variable(std::uint32_t variable, std::optional<std::uint32_t> robot);
  [[nodiscard]] Curves of_events(std::uint32_t kind, std::optional<std::uint32_t> robot);
  [[nodiscard]] EventCounts& counts_of(std::uint32_t kind, std::optional<std::uint32_t> robot);
  [[nodiscard]] const proto::Record* record_at(std::uint64_t offset);
  [[nodiscard]] double seconds(std::int64_t tick) const;
  [[nodiscard]] std::size_t stride(std::size_t entries, std::size_t entry_bytes) const;

  recorder::Reader& reader_;
  const recorder::StateIndex& index_;
  ResidualCurves& residuals_;
  std::vector<Plot> plots_;
  recorder::ObservableObserver observer_;                       // knows the first state
  std::map<std::size_t, std::array<double, kNumbers>> states_;  // by number of the state
  std::unique_ptr<recorder::SwarmObservables> own_;             // nullptr: the experiment names none
  recorder::ObservableObserver own_observer_;
  std::map<std::size_t, std::vector<double>> own_values_;  // by number of the state
  recorder::VariablesUntil own_variables_;                 // that own_ knows
  std::list<KnownPoints> points_;                          // the one that was used last is the first
  std::map<std::pair<std::uint32_t, std::int64_t>, Answer> answers_;
  std::list<EventCounts> event_counts_;  // the one that was used last is the first
};

}  // namespace kilotwin::view
