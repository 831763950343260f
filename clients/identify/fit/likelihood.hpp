/// Log likelihood of measurements, by the filter's innovations.
#pragma once

#include "clients/identify/fit/contact_gate.hpp"
#include "clients/identify/fit/filter_pass.hpp"

namespace kilotwin::identify {

/// Sums the log likelihood along a track: a visitor of run_filter().
struct LogLikelihood {
  double sum = 0;
  ContactGate gate;
  bool include_contacts = false;  ///< whether measurements after contacts count fully

  void start(const TrackFilter&) {}
  void step(const StepRecord& record) { gate.step(record); }
  void update(const Innovation& innovation, const Sample&) {
    // Nat; bound of one sample, so that no outlier decides alone; a value near 0 would hide true misfits.
    constexpr double kLeast = -1e3;
    const ContactGate::Counts counts = gate.update(innovation);
    if (counts == ContactGate::Counts::kAll || include_contacts)
      sum += std::max(innovation.log_likelihood, kLeast);
    else if (counts == ContactGate::Counts::kHeading)
      sum += std::max(heading_log_likelihood(innovation), kLeast);
  }
};

/// Log likelihood of one track, with the robot's bias fixed at its mean.
[[nodiscard]] LogLikelihood likelihood_of(const MotionModel&, const TrackView&, bool include_contacts = false);

}  // namespace kilotwin::identify
