#include "services/comm/firmware/fast_core.hpp"

#include <simavr/sim_avr.h>

#include <algorithm>
#include <cstring>
#include <utility>

namespace kilotwin::firmware {

using enum Operation::Kind;
using namespace data_space;  // NOLINT(google-build-using-namespace)

namespace {

/// A longer loop is executed: little would be left of the time between two interrupts.
constexpr std::uint64_t kLongestLoop = 32768;
/// A state that did not come back after this number of backward jumps is replaced as soon as at the beginning.
constexpr std::uint32_t kMostPatience = 4096;

}  // namespace

FastCore::FastCore(const avr_t& avr, const Converter* converter)
    : decoder_(avr, converter), converter_(converter), operations_(std::make_unique<Operations>()) {
  operations_->back().kind = kLibsimavrs;
  for (std::uint32_t address = kRegisters; address < kRam; ++address) {
    const bool is_own = address == kSpl || address == kSph;
    const bool is_input = decoder_.is_plain(address) && !is_own;
    if (is_input || is_direction(address) || is_direction(address - 1)) inputs_[address] = 0xff;
  }
}

/// Whether the I/O registers that instructions may look at are equal.
bool FastCore::inputs_are(const avr_t& avr, const Memory& memory) const {
  std::uint32_t differences = 0;
  for (std::uint32_t i = kRegisters; i < kRam; ++i)
    differences |= static_cast<std::uint32_t>((avr.data[i] ^ memory.data[i]) & inputs_[i]);
  return differences == 0;
}

void FastCore::forget(std::uint32_t address, std::uint32_t octets) {
  // An instruction before the page may reach into it; one that skips, delays or polls looks at the next ones.
  const std::uint32_t first = address / 2 < 4 ? 0 : address / 2 - 4;
  const std::uint32_t last = std::min<std::uint32_t>((address + octets) / 2, kFlashOctets / 2);
  for (std::uint32_t i = first; i < last; ++i) (*operations_)[i] = Operation();
}

FastCore::Run FastCore::run(avr_t& avr, std::uint64_t cycles) {
  if (waiting_.loop) {
    if (inputs_are(avr, waiting_.loop->begin)) return {skip(avr, cycles), cycles};
    interrupt(avr);
  }
  if (anchor_.pc != kNowhere && !inputs_are(avr, anchor_.memory)) forget_anchor();
  Run run = execute<true>(avr, cycles);
  if (waiting_.loop && run.passed < run.due) run.passed += skip(avr, run.due - run.passed);
  return run;
}

/// Whether the program is back at the anchor's state, after a backward jump to its place; flags and data are in `avr`.
bool FastCore::is_back(const avr_t& avr) const {
  const auto equal = [&](std::uint32_t from, std::uint32_t to) {
    return std::memcmp(avr.data + from, anchor_.memory.data.data() + from, to - from) == 0;
  };
  return equal(0, kRegisters) && equal(kSpl, kSreg + 1) && equal(kRam, kRamEnd + 1) &&
         std::memcmp(avr.sreg, anchor_.memory.flags.data(), anchor_.memory.flags.size()) == 0;
}

/// The present state becomes the anchor.
void FastCore::set_anchor(const avr_t& avr, std::uint32_t pc, std::uint64_t cycle) {
  anchor_.pc = pc;
  anchor_.cycle = cycle;
  anchor_.jumps = 0;
  anchor_.patience = anchor_.patience < kMostPatience ? 2 * anchor_.patience : kFirstPatience;
  std::memcpy(anchor_.memory.data.data(), avr.data, anchor_.memory.data.size());
  std::memcpy(anchor_.memory.flags.data(), avr.sreg, anchor_.memory.flags.size());
}

/// Executes a loop once, one instruction at a time, to find where its instructions begin. It leaves the state as it was.
void FastCore::enter_loop(avr_t& avr, std::uint32_t period) {
  auto loop = std::make_shared<Loop>();
  loop->begin = anchor_.memory;
  loop->to_boundary.reserve(period);
  while (loop->to_boundary.size() < period) {
    const std::uint64_t took = execute<false>(avr, 1).passed;
    for (std::uint64_t left = took; left > 0; --left)
      loop->to_boundary.push_back(static_cast<std::uint8_t>(left == took ? 0 : left));
  }
  avr.cycle -= period;
  waiting_ = {std::move(loop), 0};
}

/// Passes cycles within the loop, up to the first boundary of instructions at or after `cycles`.
std::uint64_t FastCore::skip(avr_t& avr, std::uint64_t cycles) {
  const std::vector<std::uint8_t>& to_boundary = waiting_.loop->to_boundary;
  const auto phase = static_cast<std::uint32_t>((waiting_.phase + cycles) % to_boundary.size());
  const std::uint64_t passed = cycles + to_boundary[phase];
  waiting_.phase = static_cast<std::uint32_t>((phase + to_boundary[phase]) % to_boundary.size());
  avr.cycle += passed;
  return passed;
}

void FastCore::settle(avr_t& avr) {
  if (!waiting_.loop) return;
  const Waiting was = std::exchange(waiting_, Waiting());
  // The I/O registers as the loop saw them.
  std::array<std::uint8_t, kRam> present;
  std::memcpy(present.data(), avr.data, present.size());
  std::memcpy(avr.data, was.loop->begin.data.data(), present.size());
  const std::uint64_t cycle = avr.cycle;
  execute<false>(avr, was.phase);
  avr.cycle = cycle;
  std::memcpy(avr.data + kRegisters, present.data() + kRegisters, kSpl - kRegisters);
  std::memcpy(avr.data + kSreg + 1, present.data() + kSreg + 1, kRam - kSreg - 1);
  forget_anchor();
}

void FastCore::interrupt(avr_t& avr) {
  settle(avr);
  forget_anchor();
}

void FastCore::rewind() {
  waiting_ = marked_;
  forget_anchor();
}

namespace {

/// The flags as libsimavr has them: an octet each, 0 or 1, from C to I.
using Flags = std::uint64_t;
constexpr Flags flag(int which) { return Flags{1} << (8 * which); }
constexpr Flags kCarry = flag(S_C), kZero = flag(S_Z), kNegative = flag(S_N), kOverflow = flag(S_V),
                kSign = flag(S_S), kHalfCarry = flag(S_H), kTransfer = flag(S_T), kInterrupts = flag(S_I);
constexpr Flags kOfResult = kZero | kNegative | kOverflow | kSign;
constexpr Flags kOfArithmetic = kOfResult | kCarry | kHalfCarry;

constexpr std::uint8_t as_octet(Flags flags) {
  return static_cast<std::uint8_t>(flags * 0x0102040810204080u >> 56);
}

/// Per octet: the flags as a word, and those that tell zero and sign of a result without overflow.
struct FlagTables {
  std::array<Flags, 256> spread{}, of_result{};
};
constexpr FlagTables make_tables() {
  FlagTables tables;
  for (unsigned octet = 0; octet < 256; ++octet) {
    for (int i = 0; i < 8; ++i) tables.spread[octet] |= (octet >> i & 1) != 0 ? flag(i) : 0;
    tables.of_result[octet] = (octet == 0 ? kZero : 0) | (octet >= 0x80 ? kNegative | kSign : 0);
  }
  return tables;
}
constexpr FlagTables kTables = make_tables();

/// Overflow changes two flags: the sign is that of the true result.
constexpr Flags overflow(std::uint32_t bit) { return (kOverflow | kSign) * bit; }

}  // namespace

/// As run(), without skipping. With kSeeksLoops it ends where it finds a loop.
// NOLINTNEXTLINE(readability-function-size): one switch over the instruction set
template <bool kSeeksLoops> FastCore::Run FastCore::execute(avr_t& avr, std::uint64_t cycles) {
  std::uint8_t* const data = avr.data;
  Operation* const operations = operations_->data();
  Flags flags = 0;
  std::memcpy(&flags, avr.sreg, sizeof flags);
  std::uint32_t pc = avr.pc;
  std::uint64_t passed = 0;
  const auto is_ram = [](std::uint32_t address) { return address >= kRam && address <= kRamEnd; };
  const auto pair = [data](std::uint32_t i) { return data[i] | std::uint32_t{data[i + 1]} << 8; };
  const auto set_pair = [data](std::uint32_t i, std::uint32_t value) {
    data[i] = static_cast<std::uint8_t>(value);
    data[i + 1] = static_cast<std::uint8_t>(value >> 8);
  };
  const auto is_set = [&flags](int which) { return (flags >> (8 * which) & 1) != 0; };
  const auto add = [&flags](std::uint32_t a, std::uint32_t b, std::uint32_t carry) {
    const std::uint32_t sum = a + b + carry;
    flags = (flags & ~kOfArithmetic) |
            (kTables.of_result[sum & 0xff] ^ overflow(((a ^ sum) & (b ^ sum)) >> 7 & 1)) |
            Flags{(a ^ b ^ sum) >> 4 & 1} << (8 * S_H) | sum >> 8;
    return static_cast<std::uint8_t>(sum);
  };
  const auto difference = [](std::uint32_t a, std::uint32_t b, std::uint32_t result) {
    return (kTables.of_result[result & 0xff] ^ overflow(((a ^ b) & (a ^ result)) >> 7 & 1)) |
           Flags{(a ^ b ^ result) >> 4 & 1} << (8 * S_H) | (result >> 8 & 1);
  };
  const auto subtract = [&flags, difference](std::uint32_t a, std::uint32_t b) {
    const std::uint32_t result = a - b;
    flags = (flags & ~kOfArithmetic) | difference(a, b, result);
    return static_cast<std::uint8_t>(result);
  };
  // With the carry. Zero stays set only where it was.
  const auto subtract_on = [&flags, difference](std::uint32_t a, std::uint32_t b) {
    const std::uint32_t result = a - b - static_cast<std::uint32_t>(flags & kCarry);
    flags = (flags & ~kOfArithmetic) | (difference(a, b, result) & (flags | ~kZero));
    return static_cast<std::uint8_t>(result);
  };
  const auto logic = [&flags](std::uint32_t result) {
    flags = (flags & ~kOfResult) | kTables.of_result[result & 0xff];
    return static_cast<std::uint8_t>(result);
  };
  const auto count = [&flags](std::uint32_t result, bool overflows) {
    flags = (flags & ~kOfResult) | (kTables.of_result[result & 0xff] ^ overflow(overflows ? 1 : 0));
    return static_cast<std::uint8_t>(result);
  };
  const auto shifted = [&flags](std::uint32_t before, std::uint32_t after) {
    const std::uint32_t carry = before & 1;
    flags = (flags & ~(kOfResult | kCarry)) |
            (kTables.of_result[after & 0xff] ^ overflow((after >> 7 & 1) ^ carry)) | carry;
    return static_cast<std::uint8_t>(after);
  };
  const auto of_word = [&flags](std::uint32_t result, std::uint32_t overflows, std::uint32_t carry) {
    const Flags negative = result >> 15 & 1;
    flags = (flags & ~(kOfResult | kCarry)) |
            (((result & 0xffff) == 0 ? kZero : 0) |
             ((negative * (kNegative | kSign)) ^ overflow(overflows >> 15 & 1))) |
            (carry >> 15 & 1);
  };
  const auto subtract_word = [of_word](std::uint32_t before, std::uint32_t result) {
    of_word(result, before & ~result, result & ~before);
  };
  const auto of_product = [&flags](std::uint32_t product) {
    flags = (flags & ~(kZero | kCarry)) | ((product & 0xffff) == 0 ? kZero : 0) | (product >> 15 & 1);
  };

  while (passed < cycles) {
    Operation& o = operations[pc / 2];
    std::uint32_t next = pc + 2;
    std::uint32_t took = 1;
    switch (o.kind) {
      case kUnknown: o = decoder_.decode(pc); continue;
      case kLibsimavrs: goto libsimavrs;
      case kNop: break;
      case kMovw:
        data[o.d] = data[o.r];
        data[o.d + 1] = data[o.r + 1];
        break;
      case kMul: {
        const std::uint32_t product = std::uint32_t{data[o.d]} * data[o.r];
        set_pair(0, product);
        of_product(product);
        took = 2;
        break;
      }
      case kMuls: {
        const auto product = static_cast<std::uint32_t>(std::int32_t{static_cast<std::int8_t>(data[o.d])} *
                                                        static_cast<std::int8_t>(data[o.r]));
        set_pair(0, product);
        of_product(product);
        took = 2;
        break;
      }
      case kCpc: subtract_on(data[o.d], data[o.r]); break;
      case kSbc: data[o.d] = subtract_on(data[o.d], data[o.r]); break;
      case kAdd: data[o.d] = add(data[o.d], data[o.r], 0); break;
      case kAdc: data[o.d] = add(data[o.d], data[o.r], static_cast<std::uint32_t>(flags & kCarry)); break;
      case kCp: subtract(data[o.d], data[o.r]); break;
      case kSub: data[o.d] = subtract(data[o.d], data[o.r]); break;
      case kAnd: data[o.d] = logic(data[o.d] & data[o.r]); break;
      case kEor: data[o.d] = logic(data[o.d] ^ data[o.r]); break;
      case kOr: data[o.d] = logic(data[o.d] | data[o.r]); break;
      case kMov: data[o.d] = data[o.r]; break;
      case kCpi: subtract(data[o.d], o.k); break;
      case kSbci: data[o.d] = subtract_on(data[o.d], o.k); break;
      case kSubi: data[o.d] = subtract(data[o.d], o.k); break;
      case kOri: data[o.d] = logic(data[o.d] | o.k); break;
      case kAndi: data[o.d] = logic(data[o.d] & o.k); break;
      case kLdi: data[o.d] = static_cast<std::uint8_t>(o.k); break;
      case kCpse:
      case kSbrc:
      case kSbrs: {
        const bool bit = (data[o.d] >> (o.r & 7) & 1) != 0;
        const bool skips = o.kind == kCpse ? data[o.d] == data[o.r] : bit == (o.kind == kSbrs);
        if (skips) next += 2u * o.words, took += o.words;
        break;
      }
      case kLdd: {
        const std::uint32_t address = pair(o.r) + o.k;
        if (!is_ram(address)) goto libsimavrs;
        data[o.d] = data[address];
        took = 2;
        break;
      }
      case kStd: {
        const std::uint32_t address = pair(o.r) + o.k;
        if (!is_ram(address)) goto libsimavrs;
        data[address] = data[o.d];
        took = 2;
        break;
      }
      case kLdIncrement: {
        const std::uint32_t address = pair(o.r);
        if (!is_ram(address) || (o.d & ~1u) == o.r) goto libsimavrs;
        data[o.d] = data[address];
        set_pair(o.r, address + 1);
        took = 2;
        break;
      }
      case kLdDecrement: {
        const std::uint32_t address = pair(o.r) - 1;
        if (!is_ram(address) || (o.d & ~1u) == o.r) goto libsimavrs;
        data[o.d] = data[address];
        set_pair(o.r, address);
        took = 2;
        break;
      }
      case kStIncrement: {
        const std::uint32_t address = pair(o.r);
        if (!is_ram(address) || (o.d & ~1u) == o.r) goto libsimavrs;
        data[address] = data[o.d];
        set_pair(o.r, address + 1);
        took = 2;
        break;
      }
      case kStDecrement: {
        const std::uint32_t address = pair(o.r) - 1;
        if (!is_ram(address) || (o.d & ~1u) == o.r) goto libsimavrs;
        data[address] = data[o.d];
        set_pair(o.r, address);
        took = 2;
        break;
      }
      case kPoll: {
        // Nothing changes until the cycles are over. The operations below execute what does not fit.
        constexpr std::uint32_t kRound = 5;
        const std::uint64_t rounds = (cycles - passed) / kRound;
        if (rounds > 0 && (data[o.k] >> (o.r & 7) & 1) == o.r >> 3) {
          data[o.d] = data[o.k];
          passed += kRound * rounds;
          continue;
        }
        [[fallthrough]];
      }
      case kLds:
        data[o.d] = data[o.k];
        next += 2;
        took = 2;
        break;
      case kSts:
        data[o.k] = data[o.d];
        next += 2;
        took = 2;
        break;
      case kPush: {
        const std::uint32_t top = pair(kSpl);
        if (!is_ram(top)) goto libsimavrs;
        data[top] = data[o.d];
        set_pair(kSpl, top - 1);
        took = 2;
        break;
      }
      case kPop: {
        const std::uint32_t top = pair(kSpl) + 1;
        if (!is_ram(top)) goto libsimavrs;
        data[o.d] = data[top];
        set_pair(kSpl, top);
        took = 2;
        break;
      }
      case kCom:
        data[o.d] = logic(0xffu - data[o.d]);
        flags |= kCarry;
        break;
      case kNeg: data[o.d] = subtract(0, data[o.d]); break;
      case kSwap: data[o.d] = static_cast<std::uint8_t>(data[o.d] >> 4 | data[o.d] << 4); break;
      case kInc: data[o.d] = count(data[o.d] + 1u, data[o.d] == 0x7f); break;
      case kDec: data[o.d] = count(data[o.d] - 1u, data[o.d] == 0x80); break;
      case kAsr: data[o.d] = shifted(data[o.d], data[o.d] >> 1 | (data[o.d] & 0x80u)); break;
      case kLsr: data[o.d] = shifted(data[o.d], data[o.d] >> 1); break;
      case kRor:
        data[o.d] = shifted(data[o.d], data[o.d] >> 1 | static_cast<std::uint32_t>(flags & kCarry) << 7);
        break;
      case kJmp:
        next = o.k;
        took = 3;
        goto jump;
      case kRjmp:
        next = o.k;
        took = 2;
        goto jump;
      case kIjmp:
        next = pair(kZ) * 2;
        if (next >= kFlashOctets) goto libsimavrs;
        took = 2;
        goto jump;
      case kCall:
      case kRcall:
      case kIcall: {
        const std::uint32_t top = pair(kSpl), back = (pc + 2u * o.words) / 2;
        const std::uint32_t to = o.kind == kIcall ? pair(kZ) * 2 : o.k;
        if (!is_ram(top) || !is_ram(top - 1) || to >= kFlashOctets) goto libsimavrs;
        data[top] = static_cast<std::uint8_t>(back);
        data[top - 1] = static_cast<std::uint8_t>(back >> 8);
        set_pair(kSpl, top - 2);
        next = to;
        took = o.kind == kCall ? 4 : 3;
        goto jump;
      }
      case kRet: {
        const std::uint32_t top = pair(kSpl);
        if (!is_ram(top + 1) || !is_ram(top + 2)) goto libsimavrs;
        const std::uint32_t to = (std::uint32_t{data[top + 1]} << 8 | data[top + 2]) * 2;
        if (to >= kFlashOctets) goto libsimavrs;
        set_pair(kSpl, top + 2);
        next = to;
        took = 4;
        goto jump;
      }
      case kAdiw: {
        const std::uint32_t before = pair(o.d), result = (before + o.k) & 0xffff;
        set_pair(o.d, result);
        of_word(result, ~before & result, ~result & before);
        took = 2;
        break;
      }
      case kDelayBySbiw: {
        // All rounds but the last take four cycles and lead back here. The loop below executes what does not fit.
        const std::uint32_t before = pair(o.d), rounds = before == 0 ? 0xffffu : before - 1;
        const auto skipped = static_cast<std::uint32_t>(std::min<std::uint64_t>(rounds, (cycles - passed) / 4));
        if (skipped > 0) {
          const std::uint32_t after = (before - skipped) & 0xffff;
          set_pair(o.d, after);
          subtract_word((after + 1) & 0xffff, after);
          passed += 4ull * skipped;
          continue;
        }
        [[fallthrough]];
      }
      case kSbiw: {
        const std::uint32_t before = pair(o.d), result = (before - o.k) & 0xffff;
        set_pair(o.d, result);
        subtract_word(before, result);
        took = 2;
        break;
      }
      case kBrbs:
        if (!is_set(o.d)) break;
        next = o.k;
        took = 2;
        goto jump;
      case kBrbc:
        if (is_set(o.d)) break;
        next = o.k;
        took = 2;
        goto jump;
      case kBst: flags = (flags & ~kTransfer) | ((data[o.d] >> o.r & 1) != 0 ? kTransfer : 0); break;
      case kBld:
        data[o.d] = static_cast<std::uint8_t>((data[o.d] & ~(1u << o.r)) | (is_set(S_T) ? 1u : 0u) << o.r);
        break;
      case kSetFlag: flags |= flag(o.d); break;
      case kClearFlag: flags &= ~flag(o.d); break;
      case kLpm: {
        const std::uint32_t address = pair(kZ);
        if (address >= kFlashOctets) goto libsimavrs;
        data[o.d] = avr.flash[address];
        took = 3;
        break;
      }
      case kLpmIncrement: {
        const std::uint32_t address = pair(kZ);
        if ((o.d & ~1u) == kZ || address >= kFlashOctets) goto libsimavrs;
        data[o.d] = avr.flash[address];
        set_pair(kZ, address + 1);
        took = 3;
        break;
      }
      case kReadRegister: data[o.d] = data[o.k]; break;
      case kWriteDirections:
        // A program that sets its LED in each loop() writes what is there. Without pull-ups this has no effect.
        if (data[o.d] != data[o.k] || (data[o.k + 1] & ~data[o.k]) != 0) goto libsimavrs;
        break;
      case kReadFlags: data[o.d] = data[kSreg] = as_octet(flags); break;
      case kWriteStackPointer: data[o.k] = data[o.d]; break;
      case kReadConverter:
        if (!kSeeksLoops) goto libsimavrs;
        forget_anchor();
        data[o.d] = converter_->read(avr, o.k);
        next += 2;
        took = 2;
        break;
      case kWriteConverter: {
        if (!kSeeksLoops) goto libsimavrs;
        const std::uint64_t ends_in = converter_->write(avr, avr.cycle + passed, o.k, data[o.d]);
        if (ends_in == 0) goto libsimavrs;
        forget_anchor();
        cycles = std::min(cycles, passed + ends_in);
        next += 2;
        took = 2;
        break;
      }
      case kWriteFlags:
      case kEnableInterrupts: {
        const bool enables = o.kind == kEnableInterrupts || data[o.d] >> S_I != 0, were_off = !is_set(S_I);
        if (enables && were_off && (!kSeeksLoops || avr_has_pending_interrupts(&avr) != 0)) goto libsimavrs;
        if (o.kind == kWriteFlags) {
          data[kSreg] = data[o.d];
          flags = kTables.spread[data[o.d]];
        }
        if (!enables || !were_off) break;
        // Interrupts are served after the next instruction. libsimavr counts up to 0, at each boundary of instructions.
        flags |= kInterrupts;
        forget_anchor();
        passed += took;
        pc = next;
        avr.interrupt_state = -2;
        if (passed >= cycles) continue;
        avr.interrupt_state = -1;
        avr.pc = pc;
        avr.cycle += passed;
        std::memcpy(avr.sreg, &flags, sizeof flags);
        const std::uint64_t more = execute<false>(avr, 1).passed;
        std::memcpy(&flags, avr.sreg, sizeof flags);
        pc = avr.pc;
        avr.cycle -= passed + more;
        passed += more;
        if (more == 0) goto libsimavrs;
        if (passed < cycles || !is_set(S_I)) avr.interrupt_state = 0;
        continue;
      }
      default: __builtin_unreachable();
    }
    pc = next;
    passed += took;
    continue;
  jump:
    const bool jumps_back = next <= pc;
    pc = next;
    passed += took;
    if (!kSeeksLoops || !jumps_back) continue;
    const std::uint64_t cycle = avr.cycle + passed;
    if (pc == anchor_.pc) {
      std::memcpy(avr.sreg, &flags, sizeof flags);
      if (is_back(avr)) {
        if (cycle - anchor_.cycle > kLongestLoop) continue;
        avr.pc = pc;
        enter_loop(avr, static_cast<std::uint32_t>(cycle - anchor_.cycle));
        break;
      }
    }
    if (++anchor_.jumps < anchor_.patience) continue;
    std::memcpy(avr.sreg, &flags, sizeof flags);
    set_anchor(avr, pc, cycle);
  }
libsimavrs:
  avr.pc = pc;
  avr.cycle += passed;
  std::memcpy(avr.sreg, &flags, sizeof flags);
  return {passed, cycles};
}

}  // namespace kilotwin::firmware
