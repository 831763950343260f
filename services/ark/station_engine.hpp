/// The ARK base station: starts the robots by overhead broadcast, then answers them for its virtual environments.
///
/// Tick 0: RUN, repeated by the overhead controller. After start_broadcast_s: STOP, so that the air is free. Then, with
/// environments, at most one packet per packet_interval_s with ARK messages for the three robots that have waited longest,
/// none of which hears more often than every max(1 s, N * 0.05 s / 3) (ARK's users' rule); a packet is repeated until the
/// next, and STOP follows when nobody's turn has come. Packets leave at cycles within a tick, so that intervals are exact;
/// they answer poses of the tick before. A packet of external input takes the place of the station's own.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "core/effects/measurement.hpp"
#include "core/frames/swarm_view.hpp"
#include "core/plan/plan.hpp"
#include "services/ark/tracking/tracked_swarm.hpp"
#include "services/ark/virtual_environment.hpp"

namespace kilotwin::proto {
class StationState;
}

namespace kilotwin::ark {

/// What a step from tick k reads; all of it is of tick k.
struct Inputs {
  const SwarmView& swarm;
  std::span<const OverheadPacket> external;         ///< stamped by the ingress for this tick, in order
  std::span<const MembershipChange> memberships{};  ///< that take effect in this step, in order
};

class StationEngine {
 public:
  /// State at tick 0.
  explicit StationEngine(const RunPlan& plan);

  void step(Tick from, const Inputs& inputs);
  /// The trackers' samples of the present tick; before its frame, once at most, and only where the experiment has tracked
  /// robots.
  void take(std::span<const TrackerSample> samples) { tracked_.take(now_, samples); }
  /// Where tracked robots are: a function of the state at the present tick and of its samples.
  void emit(TrackingFrame& frame) const { tracked_.emit(now_, frame); }
  [[nodiscard]] const TrackedSwarm& tracked() const { return tracked_; }
  /// The packets of the present tick.
  void emit(OverheadFrame& frame) const;
  [[nodiscard]] std::uint64_t hash_part() const;
  void save(proto::StationState& state) const;
  /// Throws RunError where no part holds a station's state.
  void load(Tick tick, std::span<const proto::StationState* const> parts);

 private:
  /// An instant or a length of simulated time, cycles of the robots' nominal clock; the start is 0.
  using Cycles = std::int64_t;

  /// The station's own packets within the tick `now_`, as far as they are due.
  void send_own(const SwarmView&);
  void send_readings(const SwarmView&);
  /// Messages for robots that are due at `t`.
  [[nodiscard]] std::vector<ArkMessage> readings(Cycles t);
  void see(const SwarmView&);
  [[nodiscard]] Cycles begin_of(Tick tick) const { return tick.count() * plan_.tick_length.cycles(); }
  void push(const OverheadPacket& packet, Cycles t);

  const RunPlan& plan_;
  const Tick start_ends_;         ///< when RUN gives way to STOP
  const Cycles packet_interval_;  ///< at least, between two packets
  const Cycles robot_interval_;   ///< at least, between two messages to one robot
  std::vector<std::unique_ptr<VirtualEnvironment>> environments_;

  Tick now_;
  TrackedSwarm tracked_;
  std::vector<OverheadPacket> packets_;  ///< of now_
  std::uint32_t next_robot_ = 0;         ///< whose turn it is: robots are served in a circle
  Cycles next_packet_;
  bool repeating_ = true;             ///< the controller repeats an own packet
  std::vector<Cycles> served_;        ///< per robot, where there are environments: when it was sent a reading last
  std::vector<std::uint32_t> turns_;  ///< per robot: how often; environments answer by turns

  // Of the step at hand: robots as the tracker sees them.
  std::vector<TrackedRobot> seen_;
  Measurement measurement_;
  MeasuredPoses measured_;
};

}  // namespace kilotwin::ark
