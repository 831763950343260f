/// The response of the robots of a set to their commands: distributions of speed and curvature under each command,
/// pooled over the set. It needs no motion model and no bias per robot. It serves to test whose commands a track
/// follows, and with which clock.
#pragma once

#include <array>
#include <vector>

#include "clients/identify/data/measured_set.hpp"

namespace kilotwin::identify {

/// Motion between two positions about one second apart, under one command.
struct MotionSegment {
  double time_s;  ///< midpoint
  double speed_mm_s;
  double curve_mm2_s2;  ///< cross product of the velocities before and after, mm^2/s^2; positive: a left turn
};

[[nodiscard]] std::vector<MotionSegment> segments_of(const Track&);

class CommandResponse {
 public:
  /// Estimates the distributions. Ignores short tracks and tracks without commands.
  explicit CommandResponse(const MeasuredSet&);

  /// Log-likelihood of a segment under a command, up to a constant. Bounded below, because robots get stuck.
  [[nodiscard]] double log_likelihood(const MotionSegment&, Motion) const;
  /// Whether the distributions differ between commands.
  [[nodiscard]] bool distinguishes_commands() const { return distinguishes_commands_; }

 private:
  struct Spread {
    double middle = 0, sd = 1;
  };
  std::array<Spread, 4> speed_, curve_;
  std::array<bool, 4> known_{};
  bool distinguishes_commands_ = false;
};

/// The command of a track at a time.
[[nodiscard]] Motion command_at(const Track&, double time_s);

}  // namespace kilotwin::identify
