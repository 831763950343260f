/// The state of all robots at one tick, gathered from the frames of partitions and hosts, as recordings hold it.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "clients/recorder/writer.hpp"
#include "core/effects/measurement.hpp"
#include "core/frames/frames.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin::cli {

class RecordedState {
 public:
  explicit RecordedState(const RunPlan& plan);

  void gather(Tick tick, std::span<const BodyFrame* const> bodies, std::span<const ActuationFrame* const> actuation);
  /// Valid until the next gather().
  [[nodiscard]] recorder::StateView view() const;

 private:
  Tick tick_;
  std::vector<double> x_mm_, y_mm_, heading_rad_;
  std::vector<std::uint8_t> led_, life_cycle_;
  std::vector<double> movable_x_mm_, movable_y_mm_, movable_heading_rad_;
  Measurement measurement_;
  MeasuredPoses measured_;
};

/// The first value that differs, in words: "robot 3: x_mm is 1.5, recorded was 1.25". Empty where every bit agrees.
[[nodiscard]] std::string first_difference(const recorder::StateView& state, const proto::StateRecord& recorded);

}  // namespace kilotwin::cli
