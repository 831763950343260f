#include "core/federation/session.hpp"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>

#include "core/base/error.hpp"
#include "core/federation/frame_io.hpp"
#include "core/federation/hash_book.hpp"
#include "core/federation/interrupt.hpp"

namespace kilotwin {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr auto kHelloPeriod = milliseconds(10);
constexpr auto kIdlePeriod = milliseconds(100);
constexpr auto kComplainAfter = milliseconds(1000);
constexpr auto kComplainEvery = milliseconds(5000);
constexpr double kFlush_s = 2.0;
/// Ticks per ledger sample.
constexpr std::size_t kLedgerTicks = 32;

std::uint64_t elapsed_ns(Clock::time_point from, Clock::time_point to) {
  return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(to - from).count());
}

Directive from_wire(const WireDirective& wire) {
  Directive directive;
  directive.sequence_number = wire.sequence_number;
  directive.tick = Tick{wire.tick};
  directive.kind = static_cast<DirectiveKind>(wire.kind);
  directive.steps = wire.steps;
  if (wire.packet._length == sizeof(OverheadPacket)) std::copy_n(wire.packet._buffer, wire.packet._length, reinterpret_cast<std::uint8_t*>(&directive.packet));
  directive.tracked_pose = {wire.robot, wire.x_mm, wire.y_mm, wire.heading_rad};
  return directive;
}

}  // namespace

Session::Session(const RunPlan& plan, FederateId self, const dds::Transport& transport, Tick first)
    : plan_(plan),
      self_(self),
      first_(first),
      now_(first),
      schedule_(first, plan.last_tick, plan.checkpoint_every()),
      peers_(plan.federates()),
      hash_first_(first_hashed(first)),
      participant_(transport) {
  member_writer_ = std::make_unique<dds::Writer<WireMember>>(participant_, topics::members());
  ledger_writer_ = std::make_unique<dds::Writer<WireLedger>>(participant_, topics::ledgers());
  if (self_ == plan_.station()) {
    directive_writer_ = std::make_unique<dds::Writer<WireDirective>>(participant_, topics::directives());
  } else {
    directive_reader_ = std::make_unique<dds::Reader<WireDirective>>(
        participant_, topics::directives(), [this](const WireDirective& wire, dds::SampleState state) {
          if (!state.valid || wire.run != plan_.run()) return;
          const std::lock_guard lock(mutex_);
          schedule_.add(from_wire(wire));
          notify();
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
  return static_cast<double>(elapsed_ns(*started_, ended_.value_or(Clock::now())) - paused_ns_) * 1e-9;
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
    peer.here = true;
    peer.phase = member.phase;
    if (member.plan_hash != plan_.hash) {
      return fail(fmt::format("{} on {} runs another experiment than this service; give all the same run directory",
                              member.name, member.host));
    }
    if (member.phase == kilotwin_wire_FAILED) return fail(fmt::format("{}: {}", member.name, member.failure));
  }
  const bool was_alive = peer.alive;
  peer.alive = state.alive;
  if (was_alive && !peer.alive && peer.phase != kilotwin_wire_FINISHED && !finished_) {
    return fail(fmt::format("{} was lost (it ended, or did not answer for {} s)", plan_.name(FederateId{member.publisher}),
                            dds::kLease_s));
  }
  notify();
}

void Session::write_member(kilotwin_wire_MemberPhase phase, const std::string& failure) {
  WireMember member{};
  char host[64] = {};
  gethostname(host, sizeof host - 1);
  const std::string name = plan_.name(self_);
  member.publisher = self_.value();
  member.run = plan_.run();
  member.plan_hash = plan_.hash;
  member.phase = phase;
  name.copy(member.name, sizeof member.name - 1);
  std::copy_n(host, sizeof host, member.host);
  member.process = static_cast<std::uint32_t>(getpid());
  failure.copy(member.failure, sizeof member.failure - 1);
  member_writer_->write(member);
}

std::string Session::names(const std::vector<FederateId>& ids) const {
  std::string result;
  for (const FederateId id : ids) {
    const std::string name = plan_.name(id);
    if (result.find(name) == std::string::npos) result += (result.empty() ? "" : "; ") + name;
  }
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

void Session::complain(Clock::time_point since, const std::string& whom) {
  const auto now = Clock::now();
  if (now < next_complaint_ || now < since + kComplainAfter) return;
  next_complaint_ = now + kComplainEvery;
  waiting_for_ = whom;
  fmt::print(stderr, "{} has waited {:.0f} s for {}\n", plan_.name(self_), static_cast<double>(elapsed_ns(since, now)) * 1e-9, whom);
}

void Session::assemble(Federate& federate) {
  const auto since = Clock::now();
  next_complaint_ = since;
  bool hears_all = false;
  for (;;) {
    for (OutputBase* output : outputs_) output->hello();
    std::unique_lock lock(mutex_);
    if (!hears_all && std::all_of(inputs_.begin(), inputs_.end(), [](InputBase* input) { return input->gate().heard_all(); })) {
      hears_all = true;
      lock.unlock();
      write_member(kilotwin_wire_HEARS_ALL);
      lock.lock();
    }
    check();
    if (interrupted() != 0) throw RunError(fmt::format("stopped by signal {} before the first tick", interrupted()));
    std::vector<FederateId> late;
    for (std::uint32_t i = 0; i < peers_.size(); ++i) {
      if (!peers_[i].here || peers_[i].phase == kilotwin_wire_ARRIVING) late.push_back(FederateId{i});
    }
    if (hears_all && late.empty()) break;
    complain(since, names(late) + " to arrive");
    arrived_.wait_for(lock, kHelloPeriod);
    lock.unlock();
    federate.idle();
  }
  waiting_for_.clear();
}

RunSchedule::Verdict Session::await(Federate& federate, Tick now) {
  const auto since = Clock::now();
  next_complaint_ = since;
  auto pause_since = since;
  std::unique_lock lock(mutex_);
  for (;;) {
    check();
    RunSchedule::Verdict verdict = RunSchedule::Verdict::kAwaitDirective;
    const bool ready = std::all_of(inputs_.begin(), inputs_.end(), [now](InputBase* input) { return input->gate().ready(now); });
    if (ready) verdict = schedule_.verdict(now);
    known_ = schedule_.known();
    const bool pause = verdict == RunSchedule::Verdict::kPaused;
    if (pause != paused_) {
      if (pause) pause_since = Clock::now();
      if (!pause) paused_ns_ += elapsed_ns(pause_since, Clock::now());
      paused_ = pause;
    }
    if (verdict == RunSchedule::Verdict::kStep || verdict == RunSchedule::Verdict::kFinished) break;
    const auto slept = Clock::now();
    if (!pause && slept >= since + kComplainAfter) {
      std::vector<FederateId> late;
      for (InputBase* input : inputs_) {
        for (const FederateId id : input->gate().missing(now)) late.push_back(id);
      }
      complain(since, late.empty() ? "a directive of the station" : names(late) + fmt::format(" (tick {})", now.count()));
    }
    if (slept >= next_idle_) {
      next_idle_ = slept + kIdlePeriod;
      lock.unlock();
      if (pause) write_ledger(federate, false);
      if (pause && schedule_.checkpoint_at(now)) save_once(federate, now);
      federate.idle();
      lock.lock();
      continue;
    }
    arrived_.wait_for(lock, kIdlePeriod);
  }
  waiting_for_.clear();
  return schedule_.verdict(now);
}

void Session::save_once(Federate& federate, Tick now) {
  if (saved_ == now) return;
  saved_ = now;
  write_ledger(federate, false);
  federate.save(now);
}

void Session::write_ledger(Federate& federate, bool last) {
  if (hash_parts_.empty() && !last) return;
  WireLedger ledger{};
  ledger.publisher = self_.value();
  ledger.run = plan_.run();
  ledger.first_tick = hash_first_.count();
  ledger.hash_parts._length = ledger.hash_parts._maximum = static_cast<std::uint32_t>(hash_parts_.size());
  ledger.hash_parts._buffer = hash_parts_.data();
  ledger.last = last;
  ledger.step_ns = step_ns_;
  ledger.exchange_ns = exchange_ns_;
  ledger.wait_ns = wait_ns_;
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto ns = [](const timeval& t) { return static_cast<std::uint64_t>(t.tv_sec) * 1'000'000'000u + static_cast<std::uint64_t>(t.tv_usec) * 1000u; };
  ledger.cpu_ns = ns(usage.ru_utime) + ns(usage.ru_stime);
  ledger.peak_memory_kib = static_cast<std::uint32_t>(usage.ru_maxrss);
  federate.count(ledger, last);
  ledger_writer_->write(ledger);
  hash_first_ = hash_first_ + static_cast<std::int64_t>(hash_parts_.size());
  hash_parts_.clear();
}

void Session::announce(const Directive& directive) {
  {
    const std::lock_guard lock(mutex_);
    schedule_.add(directive);
    known_ = schedule_.known();
  }
  WireDirective wire{};
  wire.sequence_number = directive.sequence_number;
  wire.run = plan_.run();
  wire.tick = directive.tick.count();
  wire.kind = static_cast<kilotwin_wire_DirectiveKind>(directive.kind);
  wire.steps = directive.steps;
  OverheadPacket packet = directive.packet;
  if (directive.kind == DirectiveKind::kOverheadInput) {
    wire.packet._length = wire.packet._maximum = sizeof packet;
    wire.packet._buffer = reinterpret_cast<std::uint8_t*>(&packet);
  }
  wire.robot = directive.tracked_pose.robot;
  wire.x_mm = directive.tracked_pose.x_mm;
  wire.y_mm = directive.tracked_pose.y_mm;
  wire.heading_rad = directive.tracked_pose.heading_rad;
  directive_writer_->write(wire);
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
      if (hash_parts_.size() >= kLedgerTicks) write_ledger(federate, false);
      const auto stepped = Clock::now();
      exchange_ns_ += elapsed_ns(begun, published);
      wait_ns_ += elapsed_ns(published, released);
      step_ns_ += elapsed_ns(released, stepped);
      if (stepped >= next_idle_) {
        // So that the books lag behind by wall time no more than that, also where the run goes slowly.
        next_idle_ = stepped + kIdlePeriod;
        write_ledger(federate, false);
        federate.idle();
      }
    }
    ended_ = Clock::now();
    leave(federate);
  } catch (const std::exception& error) {
    // Tell the others why, so that all name the same culprit; a failure that came from them is theirs to tell.
    const std::string line = error.what();
    bool own = false;
    {
      const std::lock_guard lock(mutex_);
      own = failure_.empty();
      finished_ = true;
    }
    try {
      write_member(kilotwin_wire_FAILED, own ? line : "left: " + line);
      member_writer_->flush(0.5);
    } catch (const std::exception&) {
      // The connection itself may be what broke; the first error is the one to tell.
    }
    throw;
  }
}

void Session::leave(Federate& federate) {
  write_ledger(federate, true);
  for (const OutputBase* output : outputs_) output->flush(kFlush_s);
  ledger_writer_->flush(kFlush_s);
  {
    const std::lock_guard lock(mutex_);
    finished_ = true;
  }
  write_member(kilotwin_wire_FINISHED);
  member_writer_->flush(kFlush_s);
}

}  // namespace kilotwin
