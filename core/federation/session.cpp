#include "core/federation/session.hpp"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>

#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "core/federation/frame_io.hpp"
#include "core/federation/hash_sums.hpp"
#include "core/os/interrupt.hpp"

namespace kilotwin {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr auto kHelloPeriod = milliseconds(10);
/// How often idle work is done, and how far by wall time the books may lag behind where a run goes slowly.
constexpr auto kIdlePeriod = milliseconds(100);
constexpr auto kComplainAfter = milliseconds(1000);
constexpr auto kComplainEvery = milliseconds(5000);
constexpr double kFlush_s = 2.0;
/// For how long a directive that frames mention may fail to come from a station that lives.
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

}  // namespace

Session::Session(const RunPlan& plan, FederateId self, const dds::Transport& transport, Tick first,
                 std::span<const Directive> inputs)
    : plan_(plan),
      self_(self),
      first_(first),
      now_(first),
      schedule_(first, plan.last_tick, plan.checkpoint_every()),
      peers_(plan.federates()),
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
  write_member(kilotwin_wire_ARRIVING);
  member_reader_ = std::make_unique<dds::Reader<WireMember>>(
      participant_, topics::members(),
      [this](const WireMember& member, dds::SampleState state) { on_member(member, state); });
}

Session::~Session() = default;

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

void Session::on_member(const WireMember& member, dds::SampleState state) {
  const std::lock_guard lock(mutex_);
  if (state.valid && member.run != plan_.run()) {
    if (!state.alive) return;  // somebody's earlier run going away
    failure_is_user_error_ = true;
    return fail(fmt::format("the DDS domain is in use by another run ({} on {}); choose another with --domain",
                            member.name, member.host));
  }
  if (member.publisher >= peers_.size()) return;
  Peer& peer = peers_[member.publisher];
  if (state.valid) {
    const bool is_other_self =
        member.publisher == self_.value() &&
        (member.process != static_cast<std::uint32_t>(getpid()) || member.host != host_name());
    if (is_other_self) {
      // Who came later leaves; who is at work does not mind.
      if (phase_ != kilotwin_wire_ARRIVING) return;
      is_double_ = failure_is_user_error_ = true;
      return fail(fmt::format("{} of this run was started already (process {} on {}); start each service once",
                              plan_.name(self_), member.process, member.host));
    }
    peer.here = true;
    peer.phase = std::max(peer.phase, member.phase);
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
  const bool was_alive = peer.alive;
  peer.alive = state.alive;
  if (was_alive && !peer.alive && peer.phase != kilotwin_wire_FINISHED && !finished_) {
    return fail(fmt::format("{} was lost (it ended, or did not answer for {} s)",
                            plan_.name(FederateId{member.publisher}), dds::kLease_s));
  }
  notify();
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
  WireMember member{};
  const std::string name = plan_.name(self_);
  member.publisher = self_.value();
  member.run = plan_.run();
  member.plan_hash = plan_.hash;
  member.phase = phase;
  name.copy(member.name, sizeof member.name - 1);
  host_name().copy(member.host, sizeof member.host - 1);
  member.process = static_cast<std::uint32_t>(getpid());
  failure.copy(member.failure, sizeof member.failure - 1);
  member_writer_->write(member);
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
  // The station turns an interrupt into the run's orderly end; nobody else can.
  if (interrupted() != 0 && self_ != plan_.station()) {
    throw RunError(fmt::format("stopped by signal {}", interrupted()));
  }
}

void Session::complain(Clock::duration waited, const std::string& whom) {
  const auto now = Clock::now();
  if (now < next_complaint_) return;
  next_complaint_ = now + kComplainEvery;
  waiting_for_ = whom;
  say(fmt::format("{} has waited {:.0f} s for {}", plan_.name(self_), std::chrono::duration<double>(waited).count(),
                  whom));
}

bool Session::hears_all() const {
  return std::all_of(inputs_.begin(), inputs_.end(), [](InputBase* input) { return input->gate().heard_all(); });
}

/// Whom assembly waits for: those who have not arrived, else those whose frames do not come through; empty: nobody.
std::string Session::awaited_in_assembly() const {
  std::vector<FederateId> absent, silent, deaf;
  for (std::uint32_t i = 0; i < peers_.size(); ++i) {
    if (!peers_[i].here)
      absent.push_back(FederateId{i});
    else if (peers_[i].phase == kilotwin_wire_ARRIVING)
      deaf.push_back(FederateId{i});
  }
  if (!absent.empty()) return names(absent) + " to arrive";
  for (InputBase* input : inputs_) {
    for (const FederateId id : input->gate().unheard()) silent.push_back(id);
  }
  if (!silent.empty()) return "the frames of " + names(silent) + " to come through";
  return deaf.empty() ? "" : names(deaf) + " to hear all others";
}

void Session::assemble(Federate& federate) {
  const auto since = Clock::now();
  next_complaint_ = since + kComplainAfter;
  next_idle_ = since;
  auto next_hello = since;
  for (;;) {
    if (Clock::now() >= next_hello) {
      next_hello = Clock::now() + kHelloPeriod;
      for (OutputBase* output : outputs_) output->hello();
    }
    std::unique_lock lock(mutex_);
    if (phase_ == kilotwin_wire_ARRIVING && hears_all()) {
      lock.unlock();
      write_member(kilotwin_wire_HEARS_ALL);
      lock.lock();
    }
    check();
    if (interrupted() != 0)
      throw RunError(fmt::format("stopped by signal {} before the first tick", interrupted()));
    const std::string whom = awaited_in_assembly();
    if (whom.empty()) break;
    complain(Clock::now() - since, whom);
    arrived_.wait_until(lock, next_hello);
    lock.unlock();
    if (Clock::now() >= next_idle_) idle(federate);
  }
  waiting_for_.clear();
}

void Session::note_pause(bool pause) {
  if (pause == paused()) return;
  if (pause) {
    paused_since_ = Clock::now();
  } else {
    paused_ns_ += elapsed_ns(*paused_since_, Clock::now());
    paused_since_.reset();
  }
}

/// For whom the step from `now` waits. Throws RunError where it would wait in vain.
std::string Session::awaited(Tick now, Clock::duration waited) const {
  std::vector<FederateId> late;
  for (InputBase* input : inputs_) {
    for (const FederateId id : input->gate().missing(now)) late.push_back(id);
  }
  for (const FederateId id : late) {
    if (!peers_[id.value()].alive)
      throw RunError(fmt::format("{} left without its frame of tick {}", plan_.name(id), now.count()));
  }
  if (!late.empty()) return names(late) + fmt::format(" (tick {})", now.count());
  if (!peers_[plan_.station().value()].alive || waited > kDirectivePatience) {
    throw RunError("a directive that was mentioned did not come from the station");
  }
  return "a directive of the station";
}

RunSchedule::Verdict Session::await(Federate& federate, Tick now) {
  auto since = Clock::now();
  next_complaint_ = since + kComplainAfter;
  std::unique_lock lock(mutex_);
  for (InputBase* input : inputs_) input->gate().reading(now);
  for (;;) {
    check();
    RunSchedule::Verdict verdict = RunSchedule::Verdict::kAwaitDirective;
    const bool ready =
        std::all_of(inputs_.begin(), inputs_.end(), [now](InputBase* input) { return input->gate().ready(now); });
    if (ready) verdict = schedule_.verdict(now);
    known_ = schedule_.known();
    note_pause(verdict == RunSchedule::Verdict::kPaused);
    if (verdict == RunSchedule::Verdict::kStep || verdict == RunSchedule::Verdict::kFinished) {
      waiting_for_.clear();
      return verdict;
    }
    const auto at = Clock::now();
    if (paused()) {
      since = at;
    } else if (at >= since + kComplainAfter) {
      const std::string whom = awaited(now, at - since);
      // The station ends an interrupted run in order, but not one that has come to a halt.
      if (interrupted() != 0)
        throw RunError(fmt::format("stopped by signal {} while it waited for {}", interrupted(), whom));
      complain(at - since, whom);
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

/// The books lag behind by wall time no more than the period of this, also where the run goes slowly or stands.
void Session::idle(Federate& federate) {
  next_idle_ = Clock::now() + kIdlePeriod;
  write_metrics(federate, false);
  federate.idle();
}

void Session::save_once(Federate& federate, Tick now) {
  if (saved_ == now) return;
  saved_ = now;
  write_metrics(federate, false);
  federate.save(now);
}

void Session::write_metrics(Federate& federate, bool last) {
  if (hash_parts_.empty() && !last) return;
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
      if (hash_parts_.size() >= kMetricsTicks) write_metrics(federate, false);
      const auto stepped = Clock::now();
      exchange_ns_ += elapsed_ns(begun, published);
      wait_ns_ += elapsed_ns(published, released);
      step_ns_ += elapsed_ns(released, stepped);
      if (stepped >= next_idle_) idle(federate);
    }
    ended_ = Clock::now();
    leave(federate);
  } catch (const std::exception& error) {
    // Tell the others why, so that all name the same culprit; a failure that came from them is theirs to tell.
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
      // The connection itself may be what broke; the first error is the one to tell.
    }
    throw;
  }
}

void Session::leave(Federate& federate) {
  write_metrics(federate, true);
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
