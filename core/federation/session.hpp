/// A federate's session in a federated run. It runs in three phases:
///
///   assemble   write hello samples on all outputs until all federates hear each other (a reliable reader drops samples that
///              arrive before the writer's first heartbeat, so no frame may be sent earlier)
///   loop       wait for the pace, publish frames of tick k, wait for the inputs of tick k, step
///   leave      wait until all samples are acknowledged, then write FINISHED
///
/// A wait of more than 1 s prints the federates for which it waits; after 60 s without progress it also prints the likely cause.
/// If a federate is lost or fails, the sessions of all others end with a RunError that names it. The same holds for a federate that
/// leaves before it has sent a frame that others need, and for a malformed frame.
///
/// Every federate rewrites its member sample twice a second. A federate that is silent for patience_s() is lost. That time is
/// dds::kSilence_s, and longer before the first tick and on machines with many services per core.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "core/dds/dds.hpp"
#include "core/federation/schedule.hpp"
#include "core/federation/tick_gate.hpp"
#include "core/federation/wait_report.hpp"
#include "core/federation/wire.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin {

/// Prefix of a federate's failure text if it left because another one failed. The other's failure text follows.
inline constexpr std::string_view kLeft = "left: ";

/// Interface of a service to its session.
class Federate {
 public:
  virtual ~Federate() = default;
  /// Writes the frames of `now`.
  virtual void publish(Tick now) = 0;
  /// Whether all topics other than the inputs' frames are connected, as required for the start.
  [[nodiscard]] virtual bool hears_all() { return true; }
  /// Seconds by which the run is ahead of its pace at `now`; the session waits for them before it publishes the frames. 0 or
  /// less: no wait.
  [[nodiscard]] virtual double ahead_s(Tick now) { return static_cast<void>(now), 0.0; }
  /// Called when all inputs of `now` have arrived. `last`: the run ends at `now`; else the step from `now` follows.
  virtual void inputs_complete(Tick now, bool last) { static_cast<void>(now), static_cast<void>(last); }
  /// Advances the engine from tick `from` to the next.
  virtual void step(Tick from) = 0;
  /// This federate's share of h(now).
  [[nodiscard]] virtual std::uint64_t hash_part() const = 0;
  /// Writes this federate's part of the checkpoint at `now`.
  virtual void save(Tick now) = 0;
  /// Adds the federate's counters to a metrics sample. `last`: no further sample follows. Sequences must stay valid until the
  /// sample is written.
  virtual void count(WireMetrics& metrics, bool last) { static_cast<void>(metrics), static_cast<void>(last); }
  /// Called about every 100 ms while the session waits, and about as often while it steps.
  virtual void idle() {}
};

class Session {
 public:
  /// `first`: the tick at which the run starts: 0, or that of a checkpoint. `inputs`: directives that all federates know from the
  /// start, numbered from 0. `give_up_after_s`: longest wait without progress; 0: no limit.
  Session(const RunPlan& plan, FederateId self, const dds::Transport& transport, Tick first,
          std::span<const Directive> inputs = {}, double give_up_after_s = 0);
  ~Session();

  /// Runs `federate` to the end of the run. Throws RunError if another federate is lost or failed, or the run was interrupted.
  /// Throws UserError if another run uses the domain, or another process already runs this federate.
  void run(Federate& federate);

  [[nodiscard]] const RunPlan& plan() const { return plan_; }
  [[nodiscard]] FederateId self() const { return self_; }
  [[nodiscard]] const dds::Participant& participant() const { return participant_; }
  [[nodiscard]] Tick first() const { return first_; }
  /// To be called on the session's thread only.
  [[nodiscard]] const RunSchedule& schedule() const { return schedule_; }
  [[nodiscard]] Tick now() const { return now_; }
  [[nodiscard]] WireHeader header() const { return {self_.value(), plan_.run(), known_}; }
  /// The federates for which the session waits, one line; empty if it does not wait.
  [[nodiscard]] std::string waiting_for() const { return waiting_for_; }
  /// Whether the first tick has begun.
  [[nodiscard]] bool started() const { return started_.has_value(); }
  [[nodiscard]] bool paused() const { return paused_since_.has_value(); }
  /// Wall time since the first tick, without pauses, s.
  [[nodiscard]] double wall_s() const;

  /// The functions below are called on receive threads. The mutex guards the data that they write.
  [[nodiscard]] std::mutex& mutex() { return mutex_; }
  void notify() { arrived_.notify_one(); }
  /// False while this federate is ARRIVING: no federate steps before all hear each other.
  [[nodiscard]] bool expects_frames() const { return phase_ != kilotwin_wire_ARRIVING; }  ///< with the mutex held
  void mention(std::uint64_t directives) { schedule_.mention(directives); }               ///< with the mutex held
  void fail(const std::string& line);                                                     ///< with the mutex held
  /// Publishes a directive of the ingress. Only the station calls it, on the session's thread, and not before the first tick:
  /// until then a federate may not be there yet.
  void announce(const Directive& directive);

 private:
  friend class InputBase;
  friend class OutputBase;
  using Clock = std::chrono::steady_clock;
  struct MemberState {
    bool heard = false, alive = false;
    kilotwin_wire_MemberPhase phase = kilotwin_wire_ARRIVING;
    Clock::duration
        silent{};  ///< time since the last sample, without intervals in which this process was not scheduled
  };

  void assemble(Federate&);
  void hold(Federate&, Tick now);
  RunSchedule::Verdict await(Federate&, Tick now);
  void write_member(kilotwin_wire_MemberPhase phase, const std::string& failure = {});
  void on_member(const WireMember& member, dds::SampleState state);
  void on_member_of_another_run(const WireMember& member, bool alive);
  void fail_as_user_error(const std::string& line);
  void beat(const std::stop_token& stop);
  void watch_silence();
  [[nodiscard]] double patience_s() const;
  void on_directive(const WireDirective& wire);
  /// kFirst: an empty sample, by which the station learns that metrics arrive.
  enum class Report { kFirst, kNext, kLast };
  void write_metrics(Federate&, Report);
  void idle(Federate&);
  void save_once(Federate&, Tick now);
  void check() const;
  void set_paused(bool pause);
  [[nodiscard]] bool hears_all() const;
  [[nodiscard]] std::string missing_at_start() const;
  [[nodiscard]] std::string missing_inputs(Tick now, Clock::duration waited) const;
  void report_wait(WaitReport&, const std::string& whom);
  [[nodiscard]] std::string likely_cause() const;
  void leave(Federate&);
  [[nodiscard]] std::string names(std::vector<FederateId>) const;

  const RunPlan& plan_;
  const FederateId self_;
  const dds::Transport transport_;
  const Tick first_;
  const double give_up_after_s_;
  Tick now_;
  std::mutex mutex_;
  std::condition_variable arrived_;
  RunSchedule schedule_;     // add() and mention() are guarded by mutex_
  std::uint32_t known_ = 0;  // copy of schedule_.known() for the headers of frames
  std::string failure_;
  bool failure_is_user_error_ = false;
  bool is_double_ = false;  // another process already runs as this federate
  kilotwin_wire_MemberPhase phase_ = kilotwin_wire_ARRIVING;
  std::string waiting_for_;
  Clock::time_point next_idle_, watched_at_;
  std::vector<MemberState> members_;
  std::vector<class InputBase*> inputs_;
  std::vector<class OutputBase*> outputs_;
  std::vector<std::uint64_t> hash_parts_;
  Tick hash_first_;  // tick of hash_parts_[0]
  Tick saved_{-1};   // tick of the last checkpoint
  std::uint64_t step_ns_ = 0, exchange_ns_ = 0, wait_ns_ = 0, paused_ns_ = 0;
  std::optional<Clock::time_point> started_, ended_, paused_since_;
  bool finished_ = false;

  dds::Participant participant_;  // declared before the endpoints, so that it outlives them
  std::mutex member_mutex_;       // guards member_ and the order of its samples; taken before mutex_
  WireMember member_{};
  std::unique_ptr<dds::Writer<WireMember>> member_writer_;
  std::unique_ptr<dds::Reader<WireMember>> member_reader_;
  std::unique_ptr<dds::Writer<WireDirective>> directive_writer_;
  std::unique_ptr<dds::Reader<WireDirective>> directive_reader_;
  std::unique_ptr<dds::Writer<WireMetrics>> metrics_writer_;
  std::jthread heartbeat_;  // declared last: it ends before the writer that it uses is destroyed
};

}  // namespace kilotwin
