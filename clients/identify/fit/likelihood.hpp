/// Log likelihood of what was measured, by the filter's innovations.
#pragma once

#include "clients/identify/fit/contact_gate.hpp"
#include "clients/identify/fit/filter_pass.hpp"

namespace kilotwin::identify {

/// Sums it up along a track: a visitor of walk().
struct LogLikelihood {
  double sum = 0;
  Touched touched;
  bool with_touching = false;  ///< what was measured after touching counts as well

  void start(const TrackFilter&) {}
  void step(const StepRecord& record) { touched.step(record); }
  void update(const Innovation& innovation, const Sample&) {
    constexpr double kLeast = -1e3;
    const Touched::Counts counts = touched.update(innovation);
    if (counts == Touched::Counts::kAll || with_touching)
      sum += std::max(innovation.log_likelihood, kLeast);
    else if (counts == Touched::Counts::kHeading)
      sum += std::max(heading_log_likelihood(innovation), kLeast);
  }
};

/// Of one track, its robot's bias being known.
[[nodiscard]] LogLikelihood likelihood_of(const MotionModel&, const TrackView&, bool with_touching = false);

}  // namespace kilotwin::identify
