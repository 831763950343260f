#include "core/federation/session.hpp"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <utility>

#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "core/federation/frame_io.hpp"
#include "core/federation/hash_sums.hpp"
#include "core/federation/likely_cause.hpp"
#include "core/os/interrupt.hpp"
#include "core/os/worker_pool.hpp"

namespace kilotwin {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

/// Period of repeated hello samples: initial and longest.
constexpr auto kHelloPeriod = milliseconds(10), kLongestHelloPeriod = milliseconds(500);
/// Period of the member samples by which a federate shows that it is alive.
constexpr auto kBeatPeriod = milliseconds(500);
/// Period of idle(), which also limits the delay of metrics in a slow run.
constexpr auto kIdlePeriod = milliseconds(100);
/// Largest part of the time between two calls of watch_silence() that counts as silence. A process that was not scheduled for
/// longer could not receive either.
constexpr auto kMostWatched = milliseconds(200);
/// Patience before the first tick, and upper limit of the patience after it.
constexpr double kStartPatience_s = 30.0;
/// The patience grows with the number of services if there are more than this many per core.
constexpr double kServicesPerCore = 4.0;
constexpr double kFlush_s = 2.0;
/// Longest wait for a directive that frames mention while the station is alive.
constexpr auto kDirectivePatience = milliseconds(10'000);
/// Ticks per metrics sample.
constexpr std::size_t kMetricsTicks = 32;

std::uint64_t elapsed_ns(Clock::time_point from, Clock::time_point to) {
  return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(to - from).count());
}

std::string host_name() {
  char name[64] = {};
  gethostname(name, sizeof name - 1);
  return name;
}

template <std::size_t size> void set_text(char (&to)[size], std::string_view text) {
  std::fill(std::begin(to), std::end(to), '\0');
  text.copy(to, size - 1);
}

}  // namespace

Session::Session(const RunPlan& plan, FederateId self, const dds::Transport& transport, Tick first,
                 std::span<const Directive> inputs, double give_up_after_s)
    : plan_(plan),
      self_(self),
      transport_(transport),
      first_(first),
      give_up_after_s_(give_up_after_s),
      now_(first),
      schedule_(first, plan.last_tick, plan.checkpoint_every()),
      watched_at_(Clock::now()),
      members_(plan.federates()),
      hash_first_(first_hashed(first)),
      participant_(transport) {
  for (const Directive& directive : inputs) schedule_.add(directive);
  known_ = schedule_.known();
  member_writer_ = std::make_unique<dds::Writer<WireMember>>(participant_, topics::members());
  metrics_writer_ = std::make_unique<dds::Writer<WireMetrics>>(participant_, topics::metrics());
  if (self_ == plan_.station()) {
    directive_writer_ = std::make_unique<dds::Writer<WireDirective>>(participant_, topics::directives());
  } else {
    directive_reader_ = std::make_unique<dds::Reader<WireDirective>>(
        participant_, topics::directives(), [this](const WireDirective& wire, dds::SampleState state) {
          if (state.valid && wire.run == plan_.run()) on_directive(wire);
        });
  }
  member_.publisher = self_.value();
  member_.run = plan_.run();
  member_.arrived_us =
      std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::system_clock::now().time_since_epoch())
          .count();
  member_.plan_hash = plan_.hash;
  member_.process = static_cast<std::uint32_t>(getpid());
  set_text(member_.name, plan_.name(self_));
  set_text(member_.host, host_name());
  set_text(member_.build, plan_.build);
  write_member(kilotwin_wire_ARRIVING);
  member_reader_ = std::make_unique<dds::Reader<WireMember>>(
      participant_, topics::members(),
      [this](const WireMember& member, dds::SampleState state) { on_member(member, state); });
  heartbeat_ = std::jthread([this](const std::stop_token& stop) { beat(stop); });
}

Session::~Session() = default;

void Session::beat(const std::stop_token& stop) {
  std::condition_variable_any wake;
  for (;;) {
    std::unique_lock lock(member_mutex_);
    if (wake.wait_for(lock, stop, kBeatPeriod, [] { return false; }); stop.stop_requested()) return;
    try {
      member_writer_->write(member_);
    } catch (const RunError&) {
      return;  // the session's thread gets the same error and reports it
    }
  }
}

double Session::patience_s() const {
  if (!started_) return kStartPatience_s;
  const double cores = os::cores();
  return std::clamp(dds::kSilence_s * plan_.federates() / (kServicesPerCore * cores), dds::kSilence_s,
                    kStartPatience_s);
}

/// Fails the session if a federate has been silent for too long.
void Session::watch_silence() {
  const auto now = Clock::now();
  const auto watched = std::min<Clock::duration>(now - std::exchange(watched_at_, now), kMostWatched);
  const std::chrono::duration<double> patience(patience_s());
  const std::lock_guard lock(mutex_);
  for (std::uint32_t i = 0; i < members_.size(); ++i) {
    MemberState& member = members_[i];
    if (FederateId{i} == self_ || !member.alive || member.phase >= kilotwin_wire_FINISHED) continue;
    member.silent += watched;
    if (member.silent > patience)
      fail(fmt::format("{} was lost: nothing was heard of it for {:.1f} s", plan_.name(FederateId{i}),
                       patience.count()));
  }
}

double Session::wall_s() const {
  if (!started_) return 0;
  const auto until = ended_.value_or(Clock::now());
  const std::uint64_t pausing_ns = paused_since_ ? elapsed_ns(*paused_since_, until) : 0;
  return static_cast<double>(elapsed_ns(*started_, until) - paused_ns_ - pausing_ns) * 1e-9;
}

void Session::fail(const std::string& line) {
  if (failure_.empty()) failure_ = line;
  notify();
}

void Session::fail_as_user_error(const std::string& line) {
  if (failure_.empty()) failure_is_user_error_ = true;
  fail(line);
}

/// Fails this session while it is ARRIVING: of two runs on one domain the later one leaves.
void Session::on_member_of_another_run(const WireMember& member, bool alive) {
  if (!alive || phase_ != kilotwin_wire_ARRIVING || member.phase >= kilotwin_wire_FINISHED) return;
  const bool came_later = std::pair(member.arrived_us, member.run) > std::pair(member_.arrived_us, member_.run);
  if (member.phase == kilotwin_wire_ARRIVING && came_later) return;
  fail_as_user_error(
      fmt::format("the DDS domain {} is in use by another run ({} on {}); choose another with --domain",
                  transport_.domain, member.name, member.host));
}

void Session::on_member(const WireMember& member, dds::SampleState state) {
  const std::lock_guard lock(mutex_);
  if (member.run != plan_.run()) {
    if (state.valid) on_member_of_another_run(member, state.alive);
    return;
  }
  if (member.publisher >= members_.size()) return;
  MemberState& known = members_[member.publisher];
  const bool was_heard = std::exchange(known.heard, known.heard || state.valid), was_alive = known.alive;
  const auto was_in = known.phase;
  known.silent = {};
  if (state.valid) {
    const bool is_other_self = member.publisher == self_.value() &&
                               (member.process != member_.process || std::string_view(member.host) != member_.host);
    if (is_other_self) {
      // Of two processes with one federate id the later one leaves.
      if (phase_ != kilotwin_wire_ARRIVING) return;
      is_double_ = true;
      return fail_as_user_error(
          fmt::format("{} of this run was started already (process {} on {}); start each service once",
                      plan_.name(self_), member.process, member.host));
    }
    known.phase = std::max(known.phase, member.phase);
    if (std::string_view(member.build) != member_.build) {
      return fail(fmt::format("{} on {} is of build {}, this service is of build {}; run one build everywhere",
                              member.name, member.host, member.build, member_.build));
    }
    if (member.plan_hash != plan_.hash) {
      return fail(fmt::format("{} on {} runs another experiment than this service; give all the same run directory",
                              member.name, member.host));
    }
    if (member.phase == kilotwin_wire_FAILED) {
      const std::string_view failure = member.failure;
      return fail(failure.starts_with(kLeft) ? std::string(failure.substr(kLeft.size()))
                                             : fmt::format("{}: {}", member.name, failure));
    }
  }
  known.alive = state.alive;
  if (was_alive && !known.alive && known.phase != kilotwin_wire_FINISHED && !finished_)
    return fail(plan_.name(FederateId{member.publisher}) + " was lost: its process has ended");
  if (!was_heard || known.phase != was_in || known.alive != was_alive) notify();
}

void Session::on_directive(const WireDirective& wire) {
  const std::lock_guard lock(mutex_);
  Directive directive;
  const char* const wrong =
      from_wire(wire, directive) ? defect(directive, plan_) : "its packet is of another length";
  if (wrong != nullptr) return fail(fmt::format("directive {} is malformed: {}", wire.sequence_number, wrong));
  schedule_.add(directive);
  notify();
}

void Session::write_member(kilotwin_wire_MemberPhase phase, const std::string& failure) {
  {
    const std::lock_guard lock(mutex_);
    phase_ = phase;
  }
  const std::lock_guard lock(member_mutex_);
  member_.phase = phase;
  set_text(member_.failure, failure);
  member_writer_->write(member_);
}

std::string Session::names(std::vector<FederateId> ids) const {
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  std::string result;
  for (const FederateId id : ids) result += (result.empty() ? "" : "; ") + plan_.name(id);
  return result;
}

void Session::check() const {
  if (!failure_.empty()) {
    if (failure_is_user_error_) throw UserError(failure_);
    throw RunError(failure_);
  }
  // The station handles interrupts itself: it ends the run in order by a directive.
  if (interrupted() != 0 && self_ != plan_.station()) {
    throw RunError(fmt::format("stopped by signal {}", interrupted()));
  }
}

/// Prints at intervals the federates for which the session waits. Throws RunError after give_up_after_s_. Requires the mutex.
void Session::report_wait(WaitReport& report, const std::string& whom) {
  const auto now = Clock::now();
  const double waited_s = std::chrono::duration<double>(report.waited(now)).count();
  if (give_up_after_s_ > 0 && waited_s >= give_up_after_s_) {
    throw RunError(fmt::format("{} gave up after it had waited {:.0f} s for {}: {}", plan_.name(self_), waited_s,
                               whom, likely_cause()));
  }
  const WaitReport::Due due = report.due(now);
  if (due == WaitReport::Due::kNothing) return;
  waiting_for_ = whom;
  say(fmt::format("{} has waited {:.0f} s for {}{}", plan_.name(self_), waited_s, whom,
                  due == WaitReport::Due::kWhomAndCause ? ": " + likely_cause() : ""));
}

std::string Session::likely_cause() const {
  const auto heard = std::count_if(members_.begin(), members_.end(), [](const MemberState& m) { return m.heard; });
  return kilotwin::likely_cause(transport_, static_cast<std::uint32_t>(heard), plan_.federates());
}

bool Session::hears_all() const {
  // Of directives that are written before a reader is matched, the reader would get the last one alone.
  if (directive_writer_ && directive_writer_->readers() + 1 < plan_.federates()) return false;
  return std::all_of(inputs_.begin(), inputs_.end(), [](InputBase* input) { return input->gate().heard_all(); });
}

/// The federates for which the start waits: absent ones, else those whose hellos do not arrive here, else those that do not hear all
/// others. Empty if there are none.
std::string Session::missing_at_start() const {
  std::vector<FederateId> absent, silent, deaf;
  for (std::uint32_t i = 0; i < members_.size(); ++i) {
    if (!members_[i].heard)
      absent.push_back(FederateId{i});
    else if (members_[i].phase == kilotwin_wire_ARRIVING)
      deaf.push_back(FederateId{i});
  }
  if (!absent.empty()) return names(absent) + " to arrive";
  for (InputBase* input : inputs_) {
    for (const FederateId id : input->gate().unheard()) silent.push_back(id);
  }
  if (!silent.empty()) return "the frames of " + names(silent) + " to come through";
  if (directive_writer_ && directive_writer_->readers() + 1 < plan_.federates())
    return "all services to receive directives";
  return deaf.empty() ? "" : names(deaf) + " to hear all others";
}

void Session::assemble(Federate& federate) {
  const auto began = Clock::now();
  WaitReport report(began);
  next_idle_ = began;
  write_metrics(federate, Report::kFirst);
  // Discovery takes longer with more federates, and hellos compete with it for the processor.
  const auto first_period = std::min(kHelloPeriod * (1 + plan_.federates() / 8), kLongestHelloPeriod);
  auto next_hello = began;
  auto period = first_period;
  std::string waits_for;
  for (;;) {
    if (Clock::now() >= next_hello) {
      for (OutputBase* output : outputs_) output->hello();
      next_hello = Clock::now() + period;
      period = std::min(period * 5 / 4, kLongestHelloPeriod);
    }
    const bool federate_hears_all = federate.hears_all();
    std::unique_lock lock(mutex_);
    if (phase_ == kilotwin_wire_ARRIVING && federate_hears_all && hears_all()) {
      lock.unlock();
      write_member(kilotwin_wire_HEARS_ALL);
      lock.lock();
    }
    check();
    if (interrupted() != 0)
      throw RunError(fmt::format("stopped by signal {} before the first tick", interrupted()));
    std::string whom = missing_at_start();
    if (whom.empty()) break;
    if (whom != waits_for) {
      waits_for = std::move(whom);
      report.progress(Clock::now());
      period = first_period;
    }
    report_wait(report, waits_for);
    arrived_.wait_until(lock, next_hello);
    lock.unlock();
    if (Clock::now() >= next_idle_) idle(federate);
  }
  waiting_for_.clear();
}

/// Waits while the run is ahead of its pace. The wait lies before the frames are published, so that what
/// arrives meanwhile still counts for the tick. Nothing else is done shortly before the tick is due.
void Session::hold(Federate& federate, Tick now) {
  constexpr double kLongest_s = 1.0, kNear_s = 0.02;
  while (interrupted() == 0) {
    const double ahead_s = federate.ahead_s(now);
    if (ahead_s <= 0) return;
    const bool is_near = ahead_s < kNear_s;
    {
      std::unique_lock lock(mutex_);
      check();
      const auto due = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                          std::chrono::duration<double>(std::min(ahead_s, kLongest_s)));
      arrived_.wait_until(lock, is_near ? due : std::min(due, next_idle_));
    }
    if (!is_near && Clock::now() >= next_idle_) idle(federate);
  }
}

void Session::set_paused(bool pause) {
  if (pause == paused()) return;
  if (pause) {
    paused_since_ = Clock::now();
  } else {
    paused_ns_ += elapsed_ns(*paused_since_, Clock::now());
    paused_since_.reset();
  }
}

/// The federates for which the step from `now` waits. Throws RunError if a missing input can no longer arrive.
std::string Session::missing_inputs(Tick now, Clock::duration waited) const {
  std::vector<FederateId> late;
  for (InputBase* input : inputs_) {
    for (const FederateId id : input->gate().missing(now)) late.push_back(id);
  }
  for (const FederateId id : late) {
    if (!members_[id.value()].alive)
      throw RunError(fmt::format("{} left without its frame of tick {}", plan_.name(id), now.count()));
  }
  if (!late.empty()) return names(late) + fmt::format(" (tick {})", now.count());
  if (!members_[plan_.station().value()].alive || waited > kDirectivePatience) {
    throw RunError("a directive that was mentioned did not come from the station");
  }
  return "a directive of the station";
}

RunSchedule::Verdict Session::await(Federate& federate, Tick now) {
  WaitReport report(Clock::now());
  std::unique_lock lock(mutex_);
  for (InputBase* input : inputs_) input->gate().reading(now);
  for (;;) {
    check();
    RunSchedule::Verdict verdict = RunSchedule::Verdict::kAwaitDirective;
    const bool ready =
        std::all_of(inputs_.begin(), inputs_.end(), [now](InputBase* input) { return input->gate().ready(now); });
    if (ready) verdict = schedule_.verdict(now);
    known_ = schedule_.known();
    set_paused(verdict == RunSchedule::Verdict::kPaused);
    if (verdict == RunSchedule::Verdict::kStep || verdict == RunSchedule::Verdict::kFinished) {
      waiting_for_.clear();
      return verdict;
    }
    const auto at = Clock::now();
    if (paused()) {
      report.progress(at);
    } else if (report.waited(at) >= WaitReport::kAfter) {
      const std::string whom = missing_inputs(now, report.waited(at));
      // The station ends an interrupted run by a directive, which has no effect while the run waits for a lost input.
      if (interrupted() != 0)
        throw RunError(fmt::format("stopped by signal {} while it waited for {}", interrupted(), whom));
      report_wait(report, whom);
    }
    if (at < next_idle_) {
      arrived_.wait_until(lock, next_idle_);
      continue;
    }
    lock.unlock();
    if (paused() && schedule_.checkpoint_at(now)) save_once(federate, now);
    idle(federate);
    lock.lock();
  }
}

/// Called at least every kIdlePeriod, also while the run is slow, waits or pauses.
void Session::idle(Federate& federate) {
  next_idle_ = Clock::now() + kIdlePeriod;
  watch_silence();
  write_metrics(federate, Report::kNext);
  federate.idle();
}

void Session::save_once(Federate& federate, Tick now) {
  if (saved_ == now) return;
  saved_ = now;
  write_metrics(federate, Report::kNext);
  federate.save(now);
}

void Session::write_metrics(Federate& federate, Report report) {
  if (hash_parts_.empty() && report == Report::kNext) return;
  const bool last = report == Report::kLast;
  WireMetrics metrics{};
  metrics.publisher = self_.value();
  metrics.run = plan_.run();
  metrics.first_tick = hash_first_.count();
  metrics.hash_parts._length = metrics.hash_parts._maximum = static_cast<std::uint32_t>(hash_parts_.size());
  metrics.hash_parts._buffer = hash_parts_.data();
  metrics.last = last;
  metrics.step_ns = step_ns_;
  metrics.exchange_ns = exchange_ns_;
  metrics.wait_ns = wait_ns_;
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto ns = [](const timeval& t) {
    return static_cast<std::uint64_t>(t.tv_sec) * 1'000'000'000u + static_cast<std::uint64_t>(t.tv_usec) * 1000u;
  };
  metrics.cpu_ns = ns(usage.ru_utime) + ns(usage.ru_stime);
  metrics.peak_memory_kib = static_cast<std::uint32_t>(usage.ru_maxrss);
  federate.count(metrics, last);
  metrics_writer_->write(metrics);
  hash_first_ = hash_first_ + static_cast<std::int64_t>(hash_parts_.size());
  hash_parts_.clear();
}

void Session::announce(const Directive& directive) {
  {
    const std::lock_guard lock(mutex_);
    schedule_.add(directive);
    known_ = schedule_.known();
  }
  directive_writer_->write(to_wire(plan_.run(), directive));
}

void Session::run(Federate& federate) {
  try {
    assemble(federate);
    started_ = next_idle_ = Clock::now();
    write_member(kilotwin_wire_STEPPING);
    if (hash_first_ == now_) hash_parts_.push_back(federate.hash_part());
    for (;;) {
      const auto free = Clock::now();
      hold(federate, now_);
      const auto begun = Clock::now();
      federate.publish(now_);
      const auto published = Clock::now();
      const RunSchedule::Verdict verdict = await(federate, now_);
      const auto released = Clock::now();
      federate.inputs_complete(now_, verdict == RunSchedule::Verdict::kFinished);
      if (schedule_.checkpoint_at(now_)) save_once(federate, now_);
      if (verdict == RunSchedule::Verdict::kFinished) break;
      federate.step(now_);
      ++now_;
      hash_parts_.push_back(federate.hash_part());
      if (hash_parts_.size() >= kMetricsTicks) write_metrics(federate, Report::kNext);
      const auto stepped = Clock::now();
      exchange_ns_ += elapsed_ns(begun, published);
      wait_ns_ += elapsed_ns(free, begun) + elapsed_ns(published, released);
      step_ns_ += elapsed_ns(released, stepped);
      if (stepped >= next_idle_) idle(federate);
    }
    ended_ = Clock::now();
    leave(federate);
  } catch (const std::exception& error) {
    // Publish the failure, so that all federates report the same one. Mark a failure that came from another federate.
    const std::string line = error.what();
    bool own = false;
    if (!ended_) ended_ = Clock::now();
    {
      const std::lock_guard lock(mutex_);
      own = failure_.empty();
      finished_ = true;
    }
    if (is_double_) throw;
    try {
      write_member(kilotwin_wire_FAILED, own ? line : std::string(kLeft) + line);
      member_writer_->flush(0.5);
    } catch (const std::exception&) {
      // The connection may have caused the failure. Report the first error.
    }
    throw;
  }
}

void Session::leave(Federate& federate) {
  write_metrics(federate, Report::kLast);
  for (const OutputBase* output : outputs_) output->flush(kFlush_s);
  if (directive_writer_) directive_writer_->flush(kFlush_s);
  metrics_writer_->flush(kFlush_s);
  {
    const std::lock_guard lock(mutex_);
    finished_ = true;
  }
  write_member(kilotwin_wire_FINISHED);
  member_writer_->flush(kFlush_s);
}

}  // namespace kilotwin
