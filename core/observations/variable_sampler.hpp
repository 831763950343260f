/// VariableSampler: reads recorded variables out of robots' memories at the ticks at which they are due. Nothing that it does
/// affects a result.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/recording_schedule.hpp"
#include "core/observations/variable_place.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin {

namespace proto {
class Observations;
}

class VariableSampler {
 public:
  /// For the robots of a share that run firmware, or for those that do not.
  VariableSampler(const RunPlan& plan, Share share, bool firmware);

  [[nodiscard]] bool any() const { return !variables_.empty(); }
  /// Adds the variables that are due at `now`.
  void sample(Tick now, const ProgramMemory& memory, proto::Observations& to) const;

 private:
  struct Reading {
    std::uint32_t robot = 0, place = 0;  ///< index into places
  };
  struct Variable {
    std::uint32_t index = 0;  ///< in the manifest
    bool integer = false;
    RecordingSchedule schedule;
    std::vector<VariablePlace> places;
    std::vector<Reading> readings;  ///< ascending robots
  };

  std::vector<Variable> variables_;
};

}  // namespace kilotwin
