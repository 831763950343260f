/// SwarmObservables: the observables that an experiment names, evaluated state by state.
///
/// Names per robot: x_mm, y_mm, heading_rad, displacement_mm (distance from the first recorded position), led (a colour), led_r, led_g,
/// led_b (0..3), state (a life cycle), failed (0 or 1), group, robot. So is every recorded variable, with its last value. Single
/// ones: time_s; the colours off, red, green, yellow, blue, magenta, cyan, white; the life cycles sleeping, idle, setup, running...;
/// and the observables of observables.hpp: msd, spread, nearest...
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "clients/recorder/expression.hpp"
#include "clients/recorder/observables.hpp"

namespace kilotwin::recorder {

/// The kind of value that a name in an expression stands for, if these variables are recorded.
[[nodiscard]] NameKind kind_of_name(const std::string& name, const std::vector<std::string>& variables);

class SwarmObservables {
 public:
  /// `only`: robots of other groups count nowhere. Throws UserError, with the observable's name, where an expression cannot be read.
  explicit SwarmObservables(const proto::RecordingHeader& header, std::optional<std::uint32_t> only = {});

  [[nodiscard]] bool any() const { return !expressions_.empty(); }
  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }
  /// Takes the values of a variable. Those of one variable come by ascending ticks.
  void take(const proto::VariableRecord& variable);
  /// The observables at a state. `curves`: the others, up to this state.
  [[nodiscard]] std::vector<double> values(double time_s, const proto::StateRecord& state,
                                           const ObservableCurves& curves);

 private:
  [[nodiscard]] bool counts(std::size_t robot) const { return !only_ || groups_[robot] == *only_; }
  [[nodiscard]] bool uses(const std::string& name) const { return columns_.count(name) != 0; }
  void fill(double time_s, const proto::StateRecord& state, const ObservableCurves& curves);

  std::vector<std::string> names_, variables_;
  std::vector<Expression> expressions_;
  std::vector<std::uint32_t> groups_;
  const std::optional<std::uint32_t> only_;
  std::map<std::string, std::vector<double>> columns_;  ///< the values of each name that is used
  std::vector<double> start_x_mm_, start_y_mm_;
};

}  // namespace kilotwin::recorder
