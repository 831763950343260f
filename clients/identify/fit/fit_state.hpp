/// All that a fit changes, as one value. A trial works on a copy and leaves no trace; going back is assignment.
#pragma once

#include <memory>

#include "clients/identify/fit/prepared_set.hpp"
#include "clients/identify/model/camera_scale.hpp"

namespace kilotwin::identify {

struct FitState {
  /// The default model, and the tracks as measured. The set must outlive all copies.
  explicit FitState(const MeasuredSet& set) : tracks(set) {}

  MotionModel model;
  PreparedSet tracks;
  /// Spans at places of contact, which fix the camera scale; null: none.
  std::shared_ptr<const ScaleConstraint> scale;
};

}  // namespace kilotwin::identify
