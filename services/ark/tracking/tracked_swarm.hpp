/// Where the tracked robots are, from the samples of all trackers: one filter per robot, predicted over the latency.
///
/// State of a robot: position p, velocity v, heading, turn rate, with covariances. Between samples it moves on an arc:
/// v turns with the turn rate. The process noise is a white acceleration, so that the velocity's variance grows by
/// speed_change^2 per second. Samples enter by the Kalman update at their own instants. docs/explanation/tracking.md has
/// the equations.
///
/// The state at tick k holds the samples of the ticks before. The frame of tick k is a function of that state and the
/// samples that were stamped for k; commit() makes both the state at k + 1. Pure.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "core/base/time.hpp"
#include "core/frames/frames.hpp"
#include "core/frames/tracker_sample.hpp"
#include "core/plan/plan.hpp"
#include "core/plan/tracking_settings.hpp"
#include "core/trackers/measured_pose.hpp"

namespace kilotwin::proto {
class StationState;
}

namespace kilotwin::ark {

class TrackedSwarm {
 public:
  /// State at tick 0.
  explicit TrackedSwarm(const RunPlan& plan);

  /// Takes the samples of tick `now`, in their order. Once per tick at most, before emit().
  void take(Tick now, std::span<const TrackerSample> samples);
  void emit(Tick now, TrackingFrame& frame) const;
  /// The step from `now`: memberships take effect, and the next tick's state is that with the samples.
  void commit(std::span<const MembershipChange> memberships);

  /// The memberships that should change, from the state with the samples.
  void changes_due(std::vector<MembershipChange>& changes) const;
  /// Whether the robot takes part.
  [[nodiscard]] bool is_member(std::uint32_t robot) const;

  [[nodiscard]] std::uint64_t hash_part() const;
  void save(proto::StationState& state) const;
  /// Throws RunError where the robots are others.
  void load(Tick tick, const proto::StationState& state);

  /// Number of estimates that were restarted because samples contradicted them, since the start; not part of the state.
  [[nodiscard]] std::uint64_t jumps() const { return jumps_; }

 private:
  enum Value : std::size_t {
    kX,
    kY,
    kVx,
    kVy,
    kXx,
    kXy,
    kYy,  // covariance of the position
    kXvx,
    kXvy,
    kYvx,
    kYvy,  // of position and velocity
    kVxvx,
    kVxvy,
    kVyvy,  // of the velocity
    kHeading,
    kTurn,
    kHeadingVariance,
    kHeadingTurn,
    kTurnVariance,
    kValues
  };
  struct Track {
    std::array<double, kValues> v{};
    std::int64_t at = 0;    ///< cycle of the estimate
    std::int64_t seen = 0;  ///< cycle of the last sample that was used
    std::uint32_t accepted = 0,
                  outliers = 0;  ///< samples since the estimate began, at most 3; contradictions in a row
    std::uint8_t led = kUnknownLed;
    bool known = false;        ///< there is an estimate
    bool was_seen = false;     ///< since the start
    bool has_heading = false;  ///< from a tracker, or from motion
    bool in_doubt = false;
    bool is_member = false;
  };

  [[nodiscard]] std::size_t index_of(std::uint32_t robot) const;
  void apply(const TrackerSample& sample);
  void hear(const HeardMessage& heard);
  [[nodiscard]] std::optional<std::uint32_t> sender_of(const HeardMessage& heard) const;
  void measure(Track& track, const MeasuredPose& measured);
  void begin(Track& track, const MeasuredPose& measured) const;
  void measure_heading(Track& track, double heading_rad, double variance) const;
  void predict(Track& track, std::int64_t cycle) const;
  void expire(Tick now);

  const RunPlan& plan_;
  const TrackingSettings& settings_;
  const std::int64_t bridge_cycles_;
  std::vector<std::uint32_t> robots_;        ///< ascending
  std::vector<Track> state_;                 ///< per entry of robots_
  std::vector<Track> next_;                  ///< with the samples of the present tick
  std::map<std::uint32_t, IrMessage> said_;  ///< in the present tick, by robots that listeners heard
  std::uint64_t jumps_ = 0;
};

}  // namespace kilotwin::ark
