/// Run schedule: it decides when the run pauses, continues, saves and ends, and at which ticks external inputs act. It is a pure
/// state machine without clock and network. Every federate runs it on the same directives, so all decide alike.
///
/// The ingress gives each directive the next sequence number and the tick at which it takes effect, and publishes it on a topic of
/// its own. Every frame mentions how many directives its publisher knew. No federate steps past a frame that mentions a directive
/// that it has not read. A mention reaches all federates within three ticks (station -> radio -> hosts -> physics), so
/// kAnnounceAhead = 4 ticks are enough for all to apply the directive at the same tick.
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

/// Ticks from the ingress' current tick to the tick at which a directive takes effect.
inline constexpr std::int64_t kAnnounceAhead = 4;

enum class DirectiveKind : std::uint8_t {
  kPause,
  kContinue,
  kStep,
  kStop,
  kCheckpoint,
  kOverheadInput,
  kMembership,
  kRelocation
};

struct Directive {
  std::uint64_t sequence_number = 0;
  Tick tick;  ///< takes effect before the step from this tick
  DirectiveKind kind = DirectiveKind::kPause;
  std::uint32_t steps = 0;      ///< with kStep: ticks until the next pause
  OverheadPacket packet;        ///< with kOverheadInput
  MembershipChange membership;  ///< with kMembership
  Relocation relocation;        ///< with kRelocation
};

class RunSchedule {
 public:
  /// The run goes from `first` to `last`; it is saved at every positive multiple of `checkpoint_every` ticks (0: never)
  /// after `first`.
  RunSchedule(Tick first, Tick last, std::int64_t checkpoint_every);

  /// Adds a directive. Directives may arrive in any order and repeatedly.
  void add(const Directive&);
  /// Registers that a frame has mentioned `count` directives.
  void mention(std::uint64_t count) {
    if (count > mentioned_) mentioned_ = count;
  }
  /// Number of directives known without a gap, which the federate's own frames mention.
  [[nodiscard]] std::uint32_t known() const { return known_; }

  enum class Verdict { kStep, kAwaitDirective, kPaused, kFinished };
  /// The next action of a federate at `now` that has all its inputs. Successive calls need non-decreasing ticks.
  Verdict verdict(Tick now);

  // External inputs of the step from `now`; valid once the verdict at `now` is kStep.
  [[nodiscard]] const std::vector<OverheadPacket>& overhead_inputs() const { return overhead_inputs_; }
  [[nodiscard]] const std::vector<MembershipChange>& memberships() const { return memberships_; }
  [[nodiscard]] const std::vector<Relocation>& relocations() const { return relocations_; }

  /// Whether the state at `now` is to be saved; valid once the verdict at `now` is kStep or kFinished.
  [[nodiscard]] bool checkpoint_at(Tick now) const;
  /// The last tick of the run, by the directives known so far.
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
  Tick inputs_tick_{-1};  // of the three lists below
  std::vector<OverheadPacket> overhead_inputs_;
  std::vector<MembershipChange> memberships_;
  std::vector<Relocation> relocations_;
  std::vector<Tick> checkpoints_;  // by directives
};

/// Stamps external input with sequence numbers and ticks.
class Ingress {
 public:
  Ingress() = default;
  /// Continues after the directives `stamped`, which are numbered from 0.
  explicit Ingress(std::span<const Directive> stamped) : next_sequence_number_(stamped.size()) {
    for (const Directive& directive : stamped) latest_ = std::max(latest_, directive.tick);
  }
  /// Gives `directive` its sequence number and tick. `now` is the station's current tick.
  Directive stamp(Tick now, Directive directive);

 private:
  std::uint64_t next_sequence_number_ = 0;
  Tick latest_{0};        // no later directive takes effect before an earlier one
  bool pausing_ = false;  // the run is paused, or will pause, at latest_; further directives take effect at latest_
  Tick steps_end_{-1};    // tick at which the run pauses after a kStep; negative: none
};

}  // namespace kilotwin
