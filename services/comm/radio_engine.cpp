#include "services/comm/radio_engine.hpp"

#include <algorithm>

#include "core/base/error.hpp"
#include "core/base/state_hash.hpp"
#include "core/plan/radio_settings.hpp"
#include "core/plan/tracking_settings.hpp"
#include "services/comm/message_octets.hpp"

namespace kilotwin::comm {
namespace {

/// Distance whose readings stand for the overhead controller's. It hangs far above the arena, so robots read the weakest
/// calibrated signal.
constexpr double kOverheadDistance_mm = 33 + 65;

std::vector<Share> all_shares(const RunPlan& plan) {
  std::vector<Share> shares;
  for (std::uint32_t h = 0; h < plan.hosts; ++h) shares.push_back(plan.share(HostId{h}));
  return shares;
}

}  // namespace

RadioEngine::RadioEngine(const RunPlan& plan, std::unique_ptr<FirmwareRobots> firmware, Region region)
    : region_(region),
      divided_(!region.is_everywhere()),
      shares_(all_shares(plan)),
      cycles_per_tick_(plan.tick_length.cycles()),
      loss_(plan.radio_settings().loss),
      counts_pairs_(plan.recording_settings().messages),
      random_(plan.seed()),
      simple_(plan.radio_settings().model == RadioSettings::Model::kSimple),
      simple_model_(plan.radio_settings().simple),
      overhead_gains_(ranging_.gains(kOverheadDistance_mm)),
      timers_(plan),
      state_(plan.robots(), 0),
      tx_period_(plan.robots(), 0),
      message_(plan.robots()),
      crc_error_(plan.robots(), 0),
      next_send_(simple_ ? plan.robots() : 0, 0),
      links_(plan),
      neighbourhood_(links_.reach_mm(), links_.span_mm(), plan.robots()),
      table_(neighbourhood_, links_),
      channel_(neighbourhood_, table_),
      receptions_(plan.robots()),
      radio_counts_(plan.robots()),
      pairs_(counts_pairs_ ? plan.robots() : 0),
      firmware_robots_(std::move(firmware)),
      strongest_rival_(table_.used() ? plan.robots() : 0),
      jammed_(plan.robots(), 0) {
  for (std::uint32_t i = 0; i < plan.robots(); ++i) {
    const Pose pose = plan.initial_pose(i);
    neighbourhood_.place(i, pose.x_mm, pose.y_mm);
    // A real robot receives by itself; its shadow hears what it would hear here.
    const bool is_real = plan.tracked(i) && plan.program_of(i) == kNoProgram;
    deaf_.push_back(is_real);
    const bool is_silent =
        is_real && plan.tracking_settings().rules_of(i).empty() && !plan.tracking_settings().says_heard(i);
    is_external_.push_back(plan.firmware(i) || is_silent);
  }
  KILOTWIN_DEMAND(!divided_ || !plan.has_firmware());
  if (divided_) {
    owned_.assign(plan.robots(), 0);
    known_.assign(plan.robots(), 1);
    update_ownership();
  }
  // The robots' first times of sending are spread over the interval.
  for (std::uint32_t i = 0; i < next_send_.size(); ++i)
    next_send_[i] = static_cast<Cycles>(simple_model_.interval_s * kNominalClockHz *
                                        random_.uniform(Stream::kBackOff, i, Tick{-1}, 0));
  KILOTWIN_DEMAND(!plan.has_firmware() || firmware_robots_ != nullptr);
  if (plan.has_firmware())
    firmware_.emplace(plan, *firmware_robots_, timers_, neighbourhood_, links_, ranging_, overhead_gains_);
}

void RadioEngine::step(Tick from, const Inputs& inputs) {
  KILOTWIN_DEMAND(from == tick_);
  logged_.clear();
  if (divided_) take_ghosts(inputs.ghosts);
  forget(begin_of(from));
  read_poses(inputs.swarm);
  if (divided_) update_ownership();
  read_life_cycles(inputs.swarm);
  take_offers(inputs.swarm);
  overhead_.advance(inputs.overhead.packets, begin_of(from), begin_of(from + 1));
  if (simple_) {
    exchange_simply(from);
  } else {
    contend(from, inputs.swarm);
    arrive(from);
  }
  measure_logged(inputs.swarm);
  ++tick_;
}

void RadioEngine::measure_logged(const SwarmView& swarm) {
  for (MessageEvent& event : logged_) {
    const double dx = swarm.x_mm[event.sender] - swarm.x_mm[event.receiver];
    const double dy = swarm.y_mm[event.sender] - swarm.y_mm[event.receiver];
    event.distance_mm = static_cast<float>(__builtin_sqrt(dx * dx + dy * dy));
  }
}

void RadioEngine::read_poses(const SwarmView& swarm) {
  KILOTWIN_DEMAND(swarm.robots() == state_.size());
  table_.begin_tick();
  for (std::uint32_t robot = 0; robot < state_.size(); ++robot) {
    if (table_.used())
      table_.move(robot, swarm.x_mm[robot], swarm.y_mm[robot], swarm.heading_rad[robot]);
    else
      neighbourhood_.place(robot, swarm.x_mm[robot], swarm.y_mm[robot]);
  }
}

void RadioEngine::read_life_cycles(const SwarmView& swarm) {
  tx_period_ = swarm.tx_period;
  for (std::uint32_t robot = 0; robot < state_.size(); ++robot) {
    if (divided_ && known_[robot] == 0) continue;
    const auto life_cycle = static_cast<LifeCycle>(swarm.life_cycle[robot]);
    const bool deaf = life_cycle == LifeCycle::kSleeping || life_cycle == LifeCycle::kFailed ||
                      life_cycle == LifeCycle::kFlat || life_cycle == LifeCycle::kAbsent ||
                      is_external_[robot] != 0 || deaf_[robot] != 0;
    const bool running = life_cycle == LifeCycle::kRunning && is_external_[robot] == 0;
    const int kept = state_[robot] & (kHolding | kSending);
    state_[robot] = static_cast<std::uint8_t>(kept | (running ? kRunning : 0) | (deaf ? 0 : kReceptive));
    if (!running && kept != 0) drop_message(robot);
    if (firmware_ && firmware_->has(robot) && firmware_->listening(robot)) state_[robot] |= kFirmware;
  }
}

void RadioEngine::take_offers(const SwarmView& swarm) {
  for (std::size_t n = 0; n < swarm.offer_robot.size(); ++n) {
    const std::uint32_t robot = swarm.offer_robot[n];
    KILOTWIN_DEMAND(robot < state_.size());
    if (!is(robot, kRunning) || is(robot, kHolding)) continue;
    state_[robot] |= kHolding;
    message_[robot] = swarm.offer_message[n];
    crc_error_[robot] = swarm.offer_crc_error[n];
  }
}

void RadioEngine::drop_message(std::uint32_t robot) {
  state_[robot] &= static_cast<std::uint8_t>(~kHolding);
  if (!is(robot, kSending)) return;
  for (Transmission& transmission : channel_.all()) {
    if (transmission.sender == robot && !transmission.aborted) transmission.orphaned = true;
  }
}

/// Removes transmissions that ended and overlap nothing that is on the air at `begin`.
void RadioEngine::forget(Cycles begin) {
  Cycles oldest = begin;
  for (const Transmission& transmission : channel_.all()) {
    if (transmission.end >= begin) oldest = std::min(oldest, transmission.start);
  }
  for (const OverheadController::Copy& copy : overhead_.copies()) {
    if (copy.end() >= begin) oldest = std::min(oldest, copy.start);
  }
  channel_.forget(oldest);
  overhead_.forget(oldest);
}

bool RadioEngine::later(const Attempt& a, const Attempt& b) {
  return a.time != b.time ? a.time > b.time : a.robot > b.robot;
}

/// A packet that ends at `end` arrives in the tick that begins there, so that a tick contains no later event.
void RadioEngine::contend(Tick now, const SwarmView& swarm) {
  const Cycles end = begin_of(now + 1);
  channel_.locate();
  if (table_.used()) neighbourhood_.sort();
  timers_.begin_tick();
  for (std::uint32_t i = 0; i < state_.size(); ++i) {
    switch (state_[i] & (kRunning | kHolding | kSending)) {
      case kRunning | kHolding: schedule(i, end); break;
      case kRunning:
      case 0: timers_.pass(i, end); break;
      default: break;  // It is sending: its timer waits for the end of its packet.
    }
  }
  const std::vector<OverheadController::Copy>& copies = overhead_.copies();
  next_copy_ = 0;
  while (next_copy_ < copies.size() && copies[next_copy_].start < begin_of(now)) ++next_copy_;
  simulated_ = begin_of(now);
  if (!firmware_) return contend_until(end, now);
  firmware_->begin_tick(swarm);
  while (simulated_ < end) {
    const Cycles until = next_exchange(end);
    contend_until(until, now);
    run_firmware(simulated_, until, now);
    simulated_ = until;
  }
  firmware_->end_tick();
}

/// Processes start pulses in order of time. Those of robots arise on the way; the overhead controller's are known in advance.
void RadioEngine::contend_until(Cycles end, Tick now) {
  const std::vector<OverheadController::Copy>& copies = overhead_.copies();
  for (;;) {
    const bool copy = next_copy_ < copies.size() && copies[next_copy_].start < end;
    const bool robot = !attempts_.empty() && attempts_.front().time < end;
    if (copy && (!robot || copies[next_copy_].start <= attempts_.front().time)) {
      const Cycles start = copies[next_copy_++].start;
      for (Transmission& transmission : channel_.all()) {
        if (transmission.notices(start)) abort(transmission, start, now);
      }
    } else if (robot) {
      std::pop_heap(attempts_.begin(), attempts_.end(), later);
      const std::uint32_t sender = attempts_.back().robot;
      attempts_.pop_back();
      attempt(sender, now);
    } else {
      break;
    }
  }
}

/// Time until which firmware robots may run without interaction: one span, or several if no native robot sends within them, nor
/// has a packet that it may still give up.
Cycles RadioEngine::next_exchange(Cycles end) const {
  Cycles until = std::min(simulated_ + FirmwareAir::kSpan, end);
  for (const Transmission& x : channel_.all()) {
    if (!firmware_->has(x.sender) && !x.aborted && x.start + kListening > simulated_) return until;
  }
  for (int n = 1; n < FirmwareAir::kMostSpans; ++n) {
    const Cycles next = std::min(until + FirmwareAir::kSpan, end);
    if (!attempts_.empty() && attempts_.front().time < next) break;
    until = next;
  }
  return until;
}

/// Turns firmware robots' events into transmissions. Firmware robots decide themselves when to give up.
void RadioEngine::run_firmware(Cycles from, Cycles until, Tick now) {
  using Kind = PulseDecoder::Event;
  for (const FirmwareAir::Event& event : firmware_->advance(from, until, channel_, overhead_)) {
    if (event.kind == Kind::kStarted) {
      ++counters_.attempted;
      ++radio_counts_[event.robot].attempted;
      abort_interrupted(event.robot, event.time, now);
      channel_.add({event.time, event.end, event.robot, false, false, {}});
      continue;
    }
    for (Transmission& x : channel_.all()) {
      if (x.sender != event.robot || x.over) continue;
      x.over = true;
      x.end = event.end;
      x.message = event.packet.message;
      x.crc_error = event.packet.crc_error;
      if (event.kind == Kind::kReceived) continue;
      ++counters_.aborted;
      ++radio_counts_[event.robot].backed_off;
      x.aborted = true;
    }
  }
}

/// Processes the robot's interrupts before its next possible attempt, and puts the attempt on the heap.
void RadioEngine::schedule(std::uint32_t robot, Cycles end) {
  for (; timers_.next(robot) < end; timers_.interrupt(robot)) {
    if (timers_.next_clock(robot) <= tx_period_[robot]) continue;
    attempts_.push_back({timers_.next(robot), robot});
    std::push_heap(attempts_.begin(), attempts_.end(), later);
    return;
  }
}

void RadioEngine::attempt(std::uint32_t robot, Tick now) {
  // After a firmware robot has made it give up, the next attempt may fall into a span that is already simulated.
  const Cycles t = std::max(timers_.next(robot), simulated_);
  timers_.interrupt(robot);
  if (senses(robot, t)) return schedule(robot, begin_of(now + 1));
  if (owns(robot)) {
    ++counters_.attempted;
    ++radio_counts_[robot].attempted;
  }
  state_[robot] |= kSending;
  abort_interrupted(robot, t, now);
  channel_.add({t, t + kPacket, robot, false, false, message_[robot], false, crc_error_[robot]});
}

/// A start pulse of `robot`: senders in their leading octet that detect it give up.
void RadioEngine::abort_interrupted(std::uint32_t robot, Cycles t, Tick now) {
  channel_.visit_interrupted(robot, t, [&](Transmission& other) { abort(other, t, now); });
}

bool RadioEngine::senses(std::uint32_t robot, Cycles t) {
  for (const OverheadController::Copy& copy : overhead_.copies()) {
    if (copy.sensed_at(t)) return true;
  }
  return channel_.busy(robot, t);
}

void RadioEngine::abort(Transmission& transmission, Cycles t, Tick now) {
  const std::uint32_t robot = transmission.sender;
  if (firmware_ && firmware_->has(robot)) return;  // Its firmware detects the pulse itself.
  if (owns(robot)) {
    ++counters_.aborted;
    ++radio_counts_[robot].backed_off;
  }
  transmission.aborted = true;
  transmission.end = transmission.start + kStartPulse;
  state_[robot] &= static_cast<std::uint8_t>(~kSending);
  // A robot aborts at most once between two interrupts, so their count distinguishes its aborts within a tick.
  const std::uint64_t bits = random_.bits(Stream::kBackOff, robot, now, timers_.counts()[robot]);
  timers_.back_off(robot, t, static_cast<std::uint8_t>(bits >> 56));
  if (is(robot, kRunning | kHolding))
    schedule(robot, begin_of(now + 1));
  else
    timers_.pass(robot, begin_of(now + 1));
}

void RadioEngine::arrive(Tick now) {
  const Cycles begin = begin_of(now), end = begin_of(now + 1);
  arrivals_.clear();
  sent_.clear();
  const std::vector<Transmission>& transmissions = channel_.all();
  for (std::uint32_t i = 0; i < transmissions.size(); ++i) {
    const Transmission& x = transmissions[i];
    if (!x.aborted && x.end >= begin && x.end < end && (x.over || !is_external_[x.sender]))
      arrivals_.push_back({x.end, x.sender, i});
  }
  const std::vector<OverheadController::Copy>& copies = overhead_.copies();
  for (std::uint32_t i = 0; i < copies.size(); ++i) {
    if (copies[i].end() >= begin && copies[i].end() < end) arrivals_.push_back({copies[i].end(), kOverhead, i});
  }
  std::sort(arrivals_.begin(), arrivals_.end(), [](const Arrival& a, const Arrival& b) {
    return a.end != b.end ? a.end < b.end : a.sender < b.sender;
  });

  receptions_.clear();
  if (!arrivals_.empty()) neighbourhood_.sort();
  std::uint32_t ordinal = 0;
  for (const Arrival& arrival : arrivals_) {
    if (arrival.sender == kOverhead) {
      receive_copy(copies[arrival.index], ordinal++, now);
    } else {
      finish(arrival.index, end);
      receive_packet(transmissions[arrival.index], now);
    }
  }
  receptions_.close();
  std::sort(sent_.begin(), sent_.end());
}

/// A packet's success: the sender's timer continues. An interrupt during the packet is processed at its end.
void RadioEngine::finish(std::uint32_t index, Cycles end) {
  const Transmission& transmission = channel_.all()[index];
  const std::uint32_t robot = transmission.sender;
  if (owns(robot)) {
    ++counters_.sent;
    ++radio_counts_[robot].sent;
    log_sent(robot, end);
    if (counts_pairs_) pairs_.add(robot, robot);
  }
  if (firmware_ && firmware_->has(robot)) return;
  state_[robot] &= static_cast<std::uint8_t>(~kSending);
  timers_.restart_clock(robot);
  timers_.pass(robot, end);
  if (transmission.orphaned) return;
  state_[robot] &= static_cast<std::uint8_t>(~kHolding);
  if (owns(robot)) sent_.push_back(robot);
}

void RadioEngine::receive_packet(const Transmission& packet, Tick now) {
  bool jammed = false;
  for (const OverheadController::Copy& copy : overhead_.copies()) {
    jammed = jammed || copy.overlaps(packet.start, packet.end);
  }
  channel_.find_rivals(packet.sender, packet.start, packet.end, rivals_);
  receptions_.begin_message(packet.message, packet.crc_error);
  if (table_.used())
    receive_by_strength(packet, jammed, now);
  else
    receive_in_range(packet, jammed, now);
}

void RadioEngine::receive_in_range(const Transmission& packet, bool jammed, Tick now) {
  neighbourhood_.visit(packet.sender, [&](std::uint32_t receiver, double square_mm2) {
    if ((state_[receiver] & (kReceptive | kFirmware)) == 0) return;
    if (!links_.reaches(neighbourhood_, receiver, packet.sender)) return;
    const bool is_lost = jammed || std::any_of(rivals_.begin(), rivals_.end(), [&](std::uint32_t rival) {
                           return rival == receiver || (neighbourhood_.in_range(receiver, rival) &&
                                                        links_.reaches(neighbourhood_, receiver, rival));
                         });
    receive(packet, receiver, is_lost, now, [&] { return ranging_.gains(__builtin_sqrt(square_mm2)); });
  });
}

void RadioEngine::receive_by_strength(const Transmission& packet, bool jammed, Tick now) {
  constexpr float kOwn_db = 1e6F;  // A robot that sends receives nothing.
  ++packets_;
  const auto disturb = [&](std::uint32_t receiver, float margin_db) {
    Rival& rival = strongest_rival_[receiver];
    if (rival.packet != packets_ || rival.margin_db < margin_db) rival = {packets_, margin_db};
  };
  const auto noticed_db = static_cast<float>(-links_.notice_db());
  for (const std::uint32_t sender : rivals_) {
    disturb(sender, kOwn_db);
    for (const LinkTable::Link& link : table_.of(sender)) {
      if (link.margin_db > noticed_db) disturb(link.receiver, link.margin_db);
    }
  }
  const double noise_db = links_.max_packet_noise_db();
  for (const LinkTable::Link& link : table_.of(packet.sender)) {
    const std::uint32_t receiver = link.receiver;
    if ((state_[receiver] & (kReceptive | kFirmware)) == 0) continue;
    double margin_db = static_cast<double>(link.margin_db);
    if (margin_db <= -noise_db) continue;
    if (margin_db < noise_db) margin_db += links_.packet_noise_db(packet.sender, receiver, now.count());
    if (!(margin_db > 0)) continue;
    const Rival& rival = strongest_rival_[receiver];
    const bool overlapped =
        rival.packet == packets_ && margin_db < static_cast<double>(rival.margin_db) + links_.capture_db();
    receive(packet, receiver, jammed || overlapped, now,
            [&] { return links_.readings(packet.sender, receiver, now.count(), margin_db); });
  }
}

/// A packet reaches a receiver that hears it.
template <class Readings>
void RadioEngine::receive(const Transmission& packet, std::uint32_t receiver, bool is_lost, Tick now,
                          Readings readings) {
  if (!owns(receiver)) return;
  const bool firmware = is(receiver, kFirmware);
  if (is_lost) {
    ++counters_.collided;
    ++radio_counts_[receiver].collided;
  } else if (firmware ? firmware_->fades(receiver, packet.sender, packet.start)
                      : fades(receiver, now, packet.sender)) {
    ++counters_.faded;
  } else if (packet.crc_error != 0) {
    if (!firmware) receptions_.add(receiver, readings());
  } else {
    ++counters_.received;
    ++radio_counts_[receiver].received;
    log_received(receiver, packet.sender, packet.end);
    if (firmware)
      firmware_->note_reception(receiver, packet.message);
    else
      receptions_.add(receiver, readings());
    if (counts_pairs_) pairs_.add(receiver, packet.sender);
  }
}

void RadioEngine::receive_copy(const OverheadController::Copy& copy, std::uint32_t ordinal, Tick now) {
  if (!copy.is_sound()) return;
  std::fill(jammed_.begin(), jammed_.end(), std::uint8_t{0});
  for (const Transmission& transmission : channel_.all()) {
    if (!transmission.overlaps(copy.start, copy.end())) continue;
    jammed_[transmission.sender] = 1;
    if (table_.used()) {
      for (const LinkTable::Link& link : table_.of(transmission.sender))
        jammed_[link.receiver] |= link.margin_db > static_cast<float>(-links_.notice_db());
    } else {
      neighbourhood_.visit(transmission.sender, [&](std::uint32_t receiver, double) {
        jammed_[receiver] |= links_.reaches(neighbourhood_, receiver, transmission.sender);
      });
    }
  }
  receptions_.begin_message(copy.message);
  for (std::uint32_t receiver = 0; receiver < state_.size(); ++receiver) {
    if ((state_[receiver] & (kReceptive | kFirmware)) == 0 || jammed_[receiver] != 0 || !owns(receiver)) continue;
    if (is(receiver, kFirmware)) {
      if (!firmware_->fades(receiver, FirmwareAir::kOverhead, copy.start))
        firmware_->note_reception(receiver, copy.message);
    } else if (!fades(receiver, now, kLastDraw - ordinal)) {
      receptions_.add(receiver, overhead_gains_);
    }
  }
}

bool RadioEngine::fades(std::uint32_t receiver, Tick now, std::uint32_t draw) const {
  return loss_ > 0 && random_.uniform(Stream::kReception, receiver, now, draw) < loss_;
}

void RadioEngine::emit(HostId host, RadioFrame& frame) const {
  const Share share = shares_[host.value()];
  frame.tick = tick_;
  frame.first_robot = share.first;
  frame.kilo_ticks.assign(timers_.counts().begin() + share.first, timers_.counts().begin() + share.last);
  for (std::uint32_t i = share.first; divided_ && i < share.last; ++i) {
    if (!owns(i)) frame.kilo_ticks[i - share.first] = 0;
  }
  frame.ask.clear();
  const Cycles from = begin_of(tick_ + 1), until = begin_of(tick_ + 2);
  for (std::uint32_t i = share.first; i < share.last; ++i) {
    if ((state_[i] & (kRunning | kHolding | kSending)) != kRunning || !owns(i)) continue;
    if (simple_ ? next_send_[i] < until : timers_.exceeds(i, tx_period_[i], from, until)) frame.ask.push_back(i);
  }
  frame.sent.clear();
  for (const std::uint32_t robot : sent_) {
    if (share.contains(robot)) frame.sent.push_back(robot);
  }
  frame.reception_robot.clear();
  frame.reception_message.clear();
  frame.reception_high_gain.clear();
  frame.reception_low_gain.clear();
  frame.messages.clear();
  frame.message_crc_error.clear();
  receptions_.emit(share, frame);
  emit_firmware(share, frame);
}

void RadioEngine::emit_firmware(Share share, RadioFrame& frame) const {
  frame.firmware_robot.clear();
  frame.firmware_motor_left.clear();
  frame.firmware_motor_right.clear();
  frame.firmware_spin_up.clear();
  frame.firmware_led.clear();
  frame.firmware_life_cycle.clear();
  frame.firmware_fault.clear();
  if (!firmware_) return;
  const auto ids = firmware_->ids();
  for (std::uint32_t i = 0; i < ids.size(); ++i) {
    if (!share.contains(ids[i])) continue;
    const FirmwareRobots::Outputs& out = firmware_->outputs(i);
    frame.firmware_robot.push_back(ids[i]);
    frame.firmware_motor_left.push_back(out.motor_left);
    frame.firmware_motor_right.push_back(out.motor_right);
    frame.firmware_spin_up.push_back(out.spin_up);
    frame.firmware_led.push_back(out.led);
    frame.firmware_life_cycle.push_back(static_cast<std::uint8_t>(firmware_->life_cycle(i)));
    frame.firmware_fault.push_back(std::uint32_t{out.fault} << 24 | out.fault_at);
  }
}

std::uint64_t RadioEngine::hash_part() const {
  // All regions have the same overhead controller; only the region of the origin hashes it.
  std::uint64_t sum = (region_.contains(0, 0) ? overhead_.hash() : 0) + (firmware_ ? firmware_->hash() : 0);
  for (std::uint32_t i = 0; i < state_.size(); ++i) {
    if (!owns(i)) continue;
    const std::uint64_t counts =
        timers_.count_word(i) | std::uint64_t{state_[i]} << 32 | std::uint64_t{receptions_.count(i)} << 40;
    const std::uint64_t next_send = simple_ ? static_cast<std::uint64_t>(next_send_[i]) : 0;
    sum += entity_hash(HashDomain::kRadio, i, {timers_.time_word(i) + next_send, counts});
  }
  for (const Transmission& x : channel_.all()) {
    if (!owns(x.sender)) continue;
    auto [first, second] = words(x.message);
    second |= std::uint64_t{x.crc_error} << 48;
    sum += entity_hash(HashDomain::kRadio, x.sender,
                       {static_cast<std::uint64_t>(x.start), static_cast<std::uint64_t>(x.end), first, second});
  }
  return sum;
}

}  // namespace kilotwin::comm
