#include "services/comm/firmware_air.hpp"

#include <algorithm>
#include <numeric>
#include <tuple>

#include "core/base/error.hpp"
#include "core/base/state_hash.hpp"
#include "core/plan/radio_settings.hpp"
#include "idl/checkpoint.pb.h"
#include "services/comm/message_octets.hpp"

namespace kilotwin::comm {
namespace {

/// Number of bits after which any packet has ended: there may be gaps of some bits between its octets.
constexpr Cycles kLongestPacket = 13 * (kBitsPerOctet + 2);

}  // namespace

FirmwareAir::FirmwareAir(const RunPlan& plan, FirmwareRobots& robots, const TickTimers& timers,
                         const Neighbourhood& neighbourhood, LinkBudget& links, const Ranging& ranging,
                         Gains overhead_gains)
    : robots_(robots),
      neighbourhood_(neighbourhood),
      links_(links),
      ranging_(ranging),
      overhead_gains_(overhead_gains),
      cycles_per_tick_(plan.tick_length.cycles()),
      loss_(plan.radio_settings().loss),
      random_(plan.seed()),
      index_(plan.robots(), kNobody) {
  const auto ids = robots.ids();
  const std::size_t count = ids.size();
  for (std::uint32_t i = 0; i < count; ++i) {
    index_[ids[i]] = i;
    decoders_.emplace_back(timers.period(ids[i]));
  }
  outputs_.resize(count);
  life_cycle_.assign(count, LifeCycle::kIdle);
  neighbours_.resize(count);
  light_.resize(count);
  next_light_.resize(count);
  flashes_.resize(count);
  flash_starts_.resize(count);
  all_.resize(count);
  std::iota(all_.begin(), all_.end(), 0u);
  read_outputs();
}

void FirmwareAir::begin_tick(const SwarmView& swarm) {
  robots_.begin_tick(swarm);
  const auto ids = robots_.ids();
  for (std::uint32_t i = 0; i < ids.size(); ++i) {
    neighbours_[i].clear();
    for (std::uint32_t j = 0; j < ids.size(); ++j) {
      if (i == j || !links_.hears(neighbourhood_, ids[i], ids[j])) continue;
      neighbours_[i].push_back({j, gains(ids[j], ids[i])});
    }
  }
}

/// Readings of a firmware robot for a sender in range. They are without the noise of packets and readings: a processor
/// measures the pulses as they are.
Gains FirmwareAir::gains(std::uint32_t sender, std::uint32_t receiver) {
  if (links_.is_disc()) return ranging_.gains(__builtin_sqrt(neighbourhood_.square(receiver, sender)));
  return links_.gains(links_.margin_db(neighbourhood_, sender, receiver));
}

void FirmwareAir::end_tick() {
  robots_.end_tick();
  read_outputs();
}

void FirmwareAir::read_outputs() {
  for (std::uint32_t i = 0; i < outputs_.size(); ++i) {
    outputs_[i] = robots_.outputs(i);
    if (outputs_[i].fault != 0)
      life_cycle_[i] = LifeCycle::kFailed;
    else if (outputs_[i].flat)
      life_cycle_[i] = LifeCycle::kFlat;
    else if (life_cycle_[i] == LifeCycle::kFlat)
      life_cycle_[i] = LifeCycle::kIdle;  // The robot has been switched on again.
  }
}

const std::vector<FirmwareAir::Event>& FirmwareAir::advance(Cycles from, Cycles until, const Channel& channel,
                                                            const OverheadController& overhead) {
  collect_packets(from, until, channel, overhead);
  for (auto& flashes : flashes_) flashes.clear();
  find_starts();
  collect_light(from, until, light_);
  robots_.run(until, all_, light_, flashes_);
  for (;;) {
    find_starts();
    collect_light(from, until, next_light_);
    again_.clear();
    for (const std::uint32_t i : all_) {
      if (light_[i] == next_light_[i]) continue;
      light_[i].swap(next_light_[i]);
      again_.push_back(i);
    }
    if (again_.empty()) break;
    robots_.run(until, again_, light_, flashes_);
  }
  robots_.commit();
  decode_flashes(from, until);
  return events_;
}

/// Collects packets on the air from all senders but firmware robots.
void FirmwareAir::collect_packets(Cycles from, Cycles until, const Channel& channel,
                                  const OverheadController& overhead) {
  packets_.clear();
  for (const Transmission& x : channel.all()) {
    if (has(x.sender) || !x.overlaps(from, until)) continue;
    PacketBits bits;
    if (x.aborted)
      bits.set(0);
    else
      bits = packet_bits(x.message, static_cast<std::uint16_t>(message_crc(x.message) ^ x.crc_error));
    packets_.push_back({x.start, x.sender, !x.aborted && x.start + kListening > from, bits});
  }
  for (const OverheadController::Copy& copy : overhead.copies()) {
    if (copy.overlaps(from, until))
      packets_.push_back({copy.start, kOverhead, false, packet_bits(copy.message, copy.crc)});
  }
}

/// Finds the starts of firmware robots' packets from their current flashes.
void FirmwareAir::find_starts() {
  starts_.clear();
  for (const std::uint32_t i : all_) {
    flash_starts_[i].clear();
    if (flashes_[i].empty()) continue;
    PulseDecoder decoder = decoders_[i];
    for (const Cycles flash : flashes_[i]) {
      decoder.pass(flash, true);
      if (decoder.feed(flash) == PulseDecoder::Event::kStarted) starts_.push_back({flash, robots_.ids()[i]});
      flash_starts_[i].push_back(decoder.state().start);
    }
  }
}

/// Collects the light on every firmware robot.
void FirmwareAir::collect_light(Cycles from, Cycles until, std::vector<std::vector<Pulse>>& light) {
  for (auto& pulses : light) pulses.clear();
  for (const Packet& packet : packets_) {
    Cycles ends = until;
    for (const Start& start : starts_) {
      if (!packet.fragile || start.time - packet.start < kDeaf || start.time - packet.start >= kListening) continue;
      if (links_.hears(neighbourhood_, packet.sender, start.robot)) ends = std::min(ends, start.time);
    }
    const Cycles first = std::max<Cycles>(0, (from - packet.start + kBit - 1) / kBit);
    const Cycles last = std::min<Cycles>(kPacketBits, (ends - packet.start + kBit - 1) / kBit);
    for (const std::uint32_t i : all_) {
      const std::uint32_t id = robots_.ids()[i];
      Gains received = overhead_gains_;
      if (packet.sender != kOverhead) {
        if (!links_.hears(neighbourhood_, id, packet.sender)) continue;
        received = gains(packet.sender, id);
      }
      if (fades(id, packet.sender, packet.start)) continue;
      for (Cycles bit = first; bit < last; ++bit) {
        if (packet.bits[static_cast<std::size_t>(bit)]) light[i].push_back({packet.start + bit * kBit, received});
      }
    }
  }
  for (const std::uint32_t i : all_) {
    for (const Neighbour& neighbour : neighbours_[i]) {
      const std::uint32_t j = neighbour.index;
      for (std::size_t n = 0; n < flash_starts_[j].size(); ++n) {
        if (loss_ > 0 && fades(robots_.ids()[i], robots_.ids()[j], flash_starts_[j][n])) continue;
        light[i].push_back({flashes_[j][n], neighbour.gains});
      }
    }
    const auto key = [](const Pulse& p) { return std::tuple(p.time, p.gains.high, p.gains.low); };
    std::sort(light[i].begin(), light[i].end(), [&](const Pulse& a, const Pulse& b) { return key(a) < key(b); });
  }
}

bool FirmwareAir::fades(std::uint32_t receiver, std::uint32_t sender, Cycles start) const {
  if (!(loss_ > 0)) return false;
  const Cycles tick = start / cycles_per_tick_;
  const std::uint32_t draw =
      sender != kOverhead ? sender
                          : kLastDraw - static_cast<std::uint32_t>((start - tick * cycles_per_tick_) / kPacket);
  return random_.uniform(Stream::kReception, receiver, Tick{tick}, draw) < loss_;
}

/// Decodes the final flashes into events, in order of time.
void FirmwareAir::decode_flashes(Cycles from, Cycles until) {
  events_.clear();
  decoded_.assign(all_.size(), 0);
  for (Cycles begin = from; begin < until; begin += kSpan) {
    const Cycles end = std::min(begin + kSpan, until);
    const std::size_t first = events_.size();
    for (const std::uint32_t i : all_) {
      PulseDecoder& decoder = decoders_[i];
      const auto note = [&](PulseDecoder::Event kind, Cycles time) {
        Cycles ends = time;
        switch (kind) {
          case PulseDecoder::Event::kNone: return;
          case PulseDecoder::Event::kStarted: ends += decoder.bits(kLongestPacket); break;
          case PulseDecoder::Event::kReceived:
            robots_.note_sent(i);
            ends += decoder.bits(1);  // the last stop bit
            break;
          case PulseDecoder::Event::kAborted: ends = decoder.state().start + kStartPulse; break;
          case PulseDecoder::Event::kGarbled: break;
        }
        events_.push_back({kind, robots_.ids()[i], time, ends, decoder.packet()});
      };
      for (std::size_t& n = decoded_[i]; n < flashes_[i].size() && flashes_[i][n] < end; ++n) {
        note(decoder.pass(flashes_[i][n], true), flashes_[i][n]);
        note(decoder.feed(flashes_[i][n]), flashes_[i][n]);
      }
      note(decoder.pass(end, false), end);
    }
    std::stable_sort(events_.begin() + static_cast<std::ptrdiff_t>(first), events_.end(),
                     [](const Event& a, const Event& b) { return a.time < b.time; });
  }
}

void FirmwareAir::note_reception(std::uint32_t robot, const IrMessage& message) {
  LifeCycle& life = life_cycle_[index_[robot]];
  constexpr std::uint8_t kSave = 0;  // kilolib's calibration: the mode that stores its result
  switch (message[9]) {
    case 0x80:                                                                             // BOOT
    case 0x83:                                                                             // RESET
    case 0x85: life = LifeCycle::kIdle; break;                                             // WAKEUP
    case 0x84: life = LifeCycle::kSleeping; break;                                         // SLEEP
    case 0x86: life = LifeCycle::kCharging; break;                                         // CHARGE
    case 0x87: life = LifeCycle::kBattery; break;                                          // VOLTAGE
    case 0x88: life = LifeCycle::kRunning; break;                                          // RUN
    case 0x89: life = LifeCycle::kMoving; break;                                           // READUID
    case 0x8a: life = message[0] == kSave ? LifeCycle::kIdle : LifeCycle::kMoving; break;  // CALIB
    default: break;
  }
}

std::uint64_t FirmwareAir::hash() const {
  std::uint64_t sum = 0;
  for (const std::uint32_t i : all_) {
    const FirmwareRobots::Outputs& out = outputs_[i];
    const std::uint64_t shown = std::uint64_t{out.motor_left} | std::uint64_t{out.motor_right} << 8 |
                                std::uint64_t{out.led} << 16 | std::uint64_t{out.fault} << 24 |
                                std::uint64_t{out.spin_up} << 40 |
                                std::uint64_t{static_cast<std::uint8_t>(life_cycle_[i])} << 32;
    sum += entity_hash(HashDomain::kRadio, robots_.ids()[i], {robots_.word(i), shown});
  }
  return sum;
}

void FirmwareAir::save(proto::RadioState& part) const {
  for (const std::uint32_t i : all_) {
    proto::FirmwareRobotState& state = *part.add_firmware();
    state.set_robot(robots_.ids()[i]);
    state.set_processor(robots_.save(i));
    state.set_life_cycle(static_cast<std::uint32_t>(life_cycle_[i]));
    const PulseDecoder::State& packet = decoders_[i].state();
    if (!packet.busy) continue;
    state.set_packet_start(packet.start);
    state.set_octet_start(packet.octet_start);
    state.set_octet(packet.octet);
    state.set_packet_bits(packet.bits.to_string());
  }
}

void FirmwareAir::load(const proto::RadioState& part) {
  if (static_cast<std::size_t>(part.firmware_size()) != all_.size())
    throw RunError("the checkpoint is of other firmware robots; resume from another one");
  for (const std::uint32_t i : all_) {
    const proto::FirmwareRobotState& state = part.firmware(static_cast<int>(i));
    const std::string& bits = state.packet_bits();
    if (state.robot() != robots_.ids()[i] || bits.find_first_not_of("01") != std::string::npos ||
        bits.size() > kPacketBits)
      throw RunError("the checkpoint is of other firmware robots; resume from another one");
    robots_.load(i, state.processor());
    life_cycle_[i] = static_cast<LifeCycle>(state.life_cycle());
    if (!state.has_packet_start()) continue;
    decoders_[i].restore(
        {state.packet_start(), state.octet_start(), std::min(state.octet(), 12u), true, PacketBits(bits)});
  }
  read_outputs();
}

}  // namespace kilotwin::comm
