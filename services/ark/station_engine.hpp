/// The ARK base station: starts the robots by overhead broadcast, then sends what its plugins have to say.
///
/// Tick 0: RUN, repeated by the overhead controller. After start_broadcast_s: STOP, so that the air is free. Then, with
/// environments, a packet every packet_interval_s, of what waits in the queue: message_queue.hpp. A packet is repeated until
/// the next, and STOP follows when nothing waits. With packet_interval_s 0 packets follow each other as they fit on the air,
/// once each. Packets leave at cycles within a tick, so that intervals are exact. A packet of external input takes the place
/// of the station's own.
///
/// Plugins are called every service interval of theirs, with what the station sees: the camera model's picture, or the true
/// poses with the effects on what is measured.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/effects/measurement.hpp"
#include "core/frames/swarm_view.hpp"
#include "core/plan/plan.hpp"
#include "services/ark/camera_model.hpp"
#include "services/ark/message_queue.hpp"
#include "services/ark/plugin_host.hpp"
#include "services/ark/seen_robots.hpp"
#include "services/ark/simulated_hearing.hpp"
#include "services/ark/tracking/tracked_swarm.hpp"

namespace kilotwin::proto {
class StationState;
}

namespace kilotwin::ark {

/// Inputs of a step from tick k; all of them are of tick k.
struct Inputs {
  const SwarmView& swarm;
  std::span<const OverheadPacket> external;         ///< stamped by the ingress for this tick, in order
  std::span<const MembershipChange> memberships{};  ///< that take effect in this step, in order
};

/// Output of plugins in the last step, beside messages; for people and files, no part of the state.
struct PluginOutput {
  std::uint32_t environment = 0;
  std::string failure{};  ///< one line; from now on the plugin is called no more
  bool ends_run = false;  ///< by that failure
  std::vector<std::string> log_rows{};
  std::vector<station::Report> reports{};
  std::optional<station::Floor> floor{};
};

class StationEngine {
 public:
  /// State at tick 0. `run_directory` holds the objects of plugins with sources. Throws UserError where a plugin refuses its
  /// parameters.
  explicit StationEngine(const RunPlan& plan, const std::filesystem::path& run_directory = {});

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
  /// Throws RunError where no part holds a station's state, or a plugin cannot be resumed.
  void load(Tick tick, std::span<const proto::StationState* const> parts);

  /// Of the last step; those of set-ups with the first step.
  [[nodiscard]] const std::vector<PluginOutput>& outputs() const { return outputs_; }
  [[nodiscard]] const QueueCounts& counts() const { return queue_.counts(); }
  /// Whether anything sends messages of its own: environments, or simulated robots for real ones.
  [[nodiscard]] bool uses_queue() const { return !plugins_.empty() || hearing_.any(); }
  /// Of one environment; empty: it is well.
  [[nodiscard]] const std::string& failure(std::uint32_t environment) const {
    return plugins_[environment].failure;
  }
  /// Called again and again while the engine waits for a plugin, with the plugin's name. No part of the state.
  void while_plugins_compute(std::function<void(const std::string& plugin)> tell) { tell_ = std::move(tell); }
  [[nodiscard]] const SeenRobots& seen() const { return setting_.camera ? camera_->shown() : seen_; }

 private:
  struct Plugin {
    std::unique_ptr<PluginHost> host;
    std::int64_t services = 0;  ///< how often it has run
    std::int32_t interval_ms = 100;
    bool complete = false;
    std::string failure;
    std::uint64_t word = 0;
  };

  void see(const SwarmView&);
  void see_initial_poses();
  [[nodiscard]] PluginPatience patience_with(const EnvironmentSettings& setting);
  void set_up(std::uint32_t environment, bool resumed);
  void run_plugins(Tick from);
  void pass_on_hearing(const SwarmView&);
  void take(std::uint32_t environment, station::Reply reply, Tick now);
  [[nodiscard]] station::Request request(station::Call, Tick at) const;
  /// An instant or a length of simulated time, cycles of the robots' nominal clock; the start is 0.
  using Cycles = MessageQueue::Cycles;

  /// The station's own packets within the tick `now_`, as far as they are due.
  void send_own();
  void send_waiting();
  [[nodiscard]] Cycles begin_of(Tick tick) const { return tick.count() * plan_.tick_length.cycles(); }
  void push(const OverheadPacket& packet, Cycles t);

  const RunPlan& plan_;
  const StationSettings& setting_;
  const std::filesystem::path run_directory_;
  const Tick start_ends_;         ///< when RUN gives way to STOP
  const bool is_limited_;         ///< false: packets follow each other as they fit on the air
  const Cycles packet_interval_;  ///< at least, between two packets
  std::optional<CameraModel> camera_;
  const SimulatedHearing hearing_;
  MessageQueue queue_;  ///< behind the environments' places one for hearing_, if it is in use
  std::vector<Plugin> plugins_;

  Tick now_;
  TrackedSwarm tracked_;
  std::vector<OverheadPacket> packets_;  ///< of now_
  Cycles next_packet_;                   ///< when the next own packet may leave
  bool repeating_ = true;                ///< the controller repeats an own packet

  // Of the step at hand.
  SeenRobots seen_;  ///< without a camera
  Measurement measurement_;
  MeasuredPoses measured_;
  std::vector<PluginOutput> outputs_, outputs_of_set_up_;
  std::function<void(const std::string& plugin)> tell_;
};

}  // namespace kilotwin::ark
