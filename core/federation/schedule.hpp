/// When the run pauses, continues, saves and ends, and which external inputs belong to which tick: a pure state machine that
/// every federate runs on the same directives, and so with the same outcome. Free of clocks and networks.
///
/// A directive is decided by the ingress, which gives it the next sequence number and the tick from which it counts. It
/// travels by its own topic; every frame mentions how many directives its publisher knew, and no federate steps past a
/// frame that mentions one it has not read. A mention needs three ticks from the station to everybody (station -> radio ->
/// hosts -> physics), so the ingress announces kAnnounceAhead ticks ahead.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <map>
#include <span>
#include <vector>

#include "core/base/time.hpp"
#include "core/frames/frames.hpp"

namespace kilotwin {

/// How far ahead of the ingress' own tick a directive takes effect, ticks.
inline constexpr std::int64_t kAnnounceAhead = 4;

enum class DirectiveKind : std::uint8_t {
  kPause,
  kContinue,
  kStep,
  kStop,
  kCheckpoint,
  kOverheadInput,
  kTrackedPose
};

struct Directive {
  std::uint64_t sequence_number = 0;
  Tick tick;  ///< takes effect before the step from this tick
  DirectiveKind kind = DirectiveKind::kPause;
  std::uint32_t steps = 0;        ///< with kStep: ticks until the next pause
  OverheadPacket packet;          ///< with kOverheadInput
  TrackedPoseInput tracked_pose;  ///< with kTrackedPose
};

class RunSchedule {
 public:
  /// The run goes from `first` to `last`; it is saved at every positive multiple of `checkpoint_every` ticks (0: never)
  /// after `first`.
  RunSchedule(Tick first, Tick last, std::int64_t checkpoint_every);

  /// Takes a directive, in any order of arrival, repeated or not.
  void add(const Directive&);
  /// A frame mentions that `count` directives exist.
  void mention(std::uint64_t count) {
    if (count > mentioned_) mentioned_ = count;
  }
  /// How many directives are known without a gap: what own frames mention.
  [[nodiscard]] std::uint32_t known() const { return known_; }

  enum class Verdict { kStep, kAwaitDirective, kPaused, kFinished };
  /// What a federate at `now` that has all its inputs does next. Ask with non-decreasing ticks.
  Verdict verdict(Tick now);

  // What belongs to the step from `now`, once its verdict is kStep.
  [[nodiscard]] const std::vector<OverheadPacket>& overhead_inputs() const { return overhead_inputs_; }
  [[nodiscard]] const std::vector<TrackedPoseInput>& tracked_poses() const { return tracked_poses_; }

  /// Whether the state at `now` is to be saved; valid once the verdict at `now` is kStep or kFinished.
  [[nodiscard]] bool checkpoint_at(Tick now) const;
  /// Where the run ends as far as is known.
  [[nodiscard]] Tick last() const { return last_; }
  [[nodiscard]] bool stopped_early() const { return stopped_; }

 private:
  void apply_until(Tick now);

  Tick first_, last_;
  std::int64_t checkpoint_every_;
  std::uint32_t known_ = 0;
  std::deque<Directive> pending_;  // known, in sequence, and not applied yet
  std::map<std::uint64_t, Directive> out_of_order_;
  std::uint64_t mentioned_ = 0;
  bool paused_ = false;
  bool stopped_ = false;
  Tick pause_again_{-1};  // after a kStep; negative: never
  Tick inputs_tick_{-1};  // of the two lists below
  std::vector<OverheadPacket> overhead_inputs_;
  std::vector<TrackedPoseInput> tracked_poses_;
  std::vector<Tick> checkpoints_;  // by directives
};

/// Stamps external input: the one place where a tick is chosen for it.
class Ingress {
 public:
  Ingress() = default;
  /// Goes on after what has been stamped already, numbered from 0.
  explicit Ingress(std::span<const Directive> stamped) : next_sequence_number_(stamped.size()) {
    for (const Directive& directive : stamped) latest_ = std::max(latest_, directive.tick);
  }
  /// Gives `directive` its sequence number and tick; `now` is the tick at which the ingress' own federate stands.
  Directive stamp(Tick now, Directive directive);

 private:
  std::uint64_t next_sequence_number_ = 0;
  Tick latest_{0};        // no later directive takes effect before an earlier one
  bool pausing_ = false;  // the run stands, or will stand, at latest_: what comes now takes effect there
  Tick steps_end_{-1};    // where a kStep pauses again
};

}  // namespace kilotwin
