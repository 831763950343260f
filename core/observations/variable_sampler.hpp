/// VariableSampler: reads recorded variables out of robots' memories, and the voltages of their batteries, at the ticks at which
/// they are due. Nothing that it does affects a result.
#pragma once

#include <cstdint>
#include <functional>
#include <string_view>
#include <vector>

#include "core/base/recording_schedule.hpp"
#include "core/observations/variable_place.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin {

namespace proto {
class Observations;
}

/// The recorded variable of this name is no variable of a program. It is the voltage of the robot's battery, V, under the load of
/// the last tick: the mean of what the program would read.
inline constexpr std::string_view kBatteryVariable = "battery_V";

class VariableSampler {
 public:
  /// For the robots of a share that run firmware, or for those that do not.
  VariableSampler(const RunPlan& plan, Share share, bool firmware);

  [[nodiscard]] bool any() const { return !variables_.empty(); }
  /// Adds the variables that are due at `now`. `battery_V` gives a robot's voltage; it is called only if the run has batteries.
  void sample(Tick now, const ProgramMemory& memory, const std::function<double(std::uint32_t robot)>& battery_V,
              proto::Observations& to) const;

 private:
  struct Reading {
    std::uint32_t robot = 0, place = 0;  ///< index into places
  };
  struct Variable {
    std::uint32_t index = 0;  ///< in the manifest
    bool integer = false;
    RecordingSchedule schedule;
    std::vector<VariablePlace> places;
    std::vector<Reading> readings;         ///< ascending robots
    std::vector<std::uint32_t> batteries;  ///< robots whose battery is the variable, ascending
  };

  std::vector<Variable> variables_;
};

}  // namespace kilotwin
