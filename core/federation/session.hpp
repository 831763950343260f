/// A federate's part in a federated run: it finds the others, steps when its inputs are in, and leaves in order.
///
///   assemble   write hellos on all outputs until everybody hears everybody (a reliable reader drops what it is sent before
///              the first heartbeat of a writer; the hellos get that over with)
///   loop       publish frames of tick k, wait for the inputs of tick k, step
///   leave      wait until everything sent is acknowledged, say FINISHED
///
/// Any wait over 1 s says for whom; one without progress for 60 s says what the cause may be. A federate that is lost, or
/// that fails, ends the session of all others with a RunError that names it; so does one that left while something of it is
/// still missing, and a frame that cannot be ours.
///
/// Every federate rewrites its member sample twice a second. One that is silent for patience_s() is lost:
/// dds::kSilence_s, longer on crowded machines and before the first tick, when all processes compete for the cores.
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
#include "core/federation/wire.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin {

/// How the failure of a federate begins that left because of another: what follows is the other's.
inline constexpr std::string_view kLeft = "left: ";

/// What the session drives.
class Federate {
 public:
  virtual ~Federate() = default;
  /// Write the frames of `now`.
  virtual void publish(Tick now) = 0;
  /// Whether it has heard all that it must hear before the run starts, besides the frames of its inputs.
  [[nodiscard]] virtual bool hears_all() { return true; }
  /// How long the step from `now` must still wait for wall time, s; 0 or less: not at all.
  [[nodiscard]] virtual double ahead_s(Tick now) { return static_cast<void>(now), 0.0; }
  /// All inputs of `now` are here; `last`: the run ends here, else the step from it follows.
  virtual void inputs_complete(Tick now, bool last) { static_cast<void>(now), static_cast<void>(last); }
  /// Advance the engine from `from` to the next tick.
  virtual void step(Tick from) = 0;
  /// This federate's share of h(now).
  [[nodiscard]] virtual std::uint64_t hash_part() const = 0;
  /// Write this federate's part of the checkpoint of `now`.
  virtual void save(Tick now) = 0;
  /// Add what is counted; `last`: nothing follows. Sequences must outlive the call.
  virtual void count(WireMetrics& metrics, bool last) { static_cast<void>(metrics), static_cast<void>(last); }
  /// Called about every 100 ms while the session waits, and about as often while it steps.
  virtual void idle() {}
};

class Session {
 public:
  /// `first`: the tick at which the run starts (0, or that of a checkpoint). `inputs`: what all federates know from the start
  /// of what will be stamped, numbered from 0. `give_up_after_s`: how long it waits without progress, 0: for ever.
  Session(const RunPlan& plan, FederateId self, const dds::Transport& transport, Tick first,
          std::span<const Directive> inputs = {}, double give_up_after_s = 0);
  ~Session();

  /// Runs `federate` to the end of the run. Throws RunError where another federate is lost or failed, or the run was
  /// interrupted, and UserError where another run is on the domain, or this very federate runs already.
  void run(Federate& federate);

  [[nodiscard]] const RunPlan& plan() const { return plan_; }
  [[nodiscard]] FederateId self() const { return self_; }
  [[nodiscard]] const dds::Participant& participant() const { return participant_; }
  [[nodiscard]] Tick first() const { return first_; }
  /// Valid on the session's own thread.
  [[nodiscard]] const RunSchedule& schedule() const { return schedule_; }
  [[nodiscard]] Tick now() const { return now_; }
  [[nodiscard]] WireHeader header() const { return {self_.value(), plan_.run(), known_}; }
  /// One line: for whom the session waits; empty while it does not.
  [[nodiscard]] std::string waiting_for() const { return waiting_for_; }
  /// The first tick has begun.
  [[nodiscard]] bool started() const { return started_.has_value(); }
  [[nodiscard]] bool paused() const { return paused_since_.has_value(); }
  /// Wall seconds since the first tick, pauses excluded.
  [[nodiscard]] double wall_s() const;

  /// Called from receive threads: guards what they write.
  [[nodiscard]] std::mutex& mutex() { return mutex_; }
  void notify() { arrived_.notify_one(); }
  /// Nobody steps before all hear all, this federate included.
  [[nodiscard]] bool expects_frames() const { return phase_ != kilotwin_wire_ARRIVING; }  ///< with the mutex held
  void mention(std::uint64_t directives) { schedule_.mention(directives); }               ///< with the mutex held
  void fail(const std::string& line);                                                     ///< with the mutex held
  /// The ingress announces a directive (station only, own thread).
  void announce(const Directive& directive);

 private:
  friend class InputBase;
  friend class OutputBase;
  using Clock = std::chrono::steady_clock;
  struct MemberState {
    bool heard = false, alive = false;
    kilotwin_wire_MemberPhase phase = kilotwin_wire_ARRIVING;
    Clock::duration silent{};  ///< wall time that this session has watched since the last sample
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
  /// kFirst: nothing was counted yet, but the station hears by it that the metrics come through.
  enum class Report { kFirst, kNext, kLast };
  void write_metrics(Federate&, Report);
  void idle(Federate&);
  void save_once(Federate&, Tick now);
  void check() const;
  void set_paused(bool pause);
  [[nodiscard]] bool hears_all() const;
  [[nodiscard]] std::string missing_at_start() const;
  [[nodiscard]] std::string missing_inputs(Tick now, Clock::duration waited) const;
  void report_wait(Clock::time_point since, const std::string& whom);
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
  RunSchedule schedule_;     // log and mentions guarded by mutex_
  std::uint32_t known_ = 0;  // schedule_.known() as of the last look: what own frames mention
  std::string failure_;
  bool failure_is_user_error_ = false;
  bool is_double_ = false;  // another process is this federate already
  kilotwin_wire_MemberPhase phase_ = kilotwin_wire_ARRIVING;
  std::string waiting_for_;
  Clock::time_point next_report_, next_idle_, watched_at_;
  bool cause_told_ = false;  // of the present wait
  std::vector<MemberState> members_;
  std::vector<class InputBase*> inputs_;
  std::vector<class OutputBase*> outputs_;
  std::vector<std::uint64_t> hash_parts_;
  Tick hash_first_;  // of hash_parts_
  Tick saved_{-1};   // the last checkpoint
  std::uint64_t step_ns_ = 0, exchange_ns_ = 0, wait_ns_ = 0, paused_ns_ = 0;
  std::optional<Clock::time_point> started_, ended_, paused_since_;
  bool finished_ = false;

  dds::Participant participant_;  // before the endpoints, so that it outlives them
  std::mutex member_mutex_;       // guards member_ and the order of its samples; taken before mutex_
  WireMember member_{};
  std::unique_ptr<dds::Writer<WireMember>> member_writer_;
  std::unique_ptr<dds::Reader<WireMember>> member_reader_;
  std::unique_ptr<dds::Writer<WireDirective>> directive_writer_;
  std::unique_ptr<dds::Reader<WireDirective>> directive_reader_;
  std::unique_ptr<dds::Writer<WireMetrics>> metrics_writer_;
  std::jthread heart_;  // last: ends before the writer that it uses
};

}  // namespace kilotwin
