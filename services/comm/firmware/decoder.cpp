#include "services/comm/firmware/decoder.hpp"

#include <simavr/sim_avr.h>

namespace kilotwin::firmware {

using enum Operation::Kind;
using namespace data_space;  // NOLINT(google-build-using-namespace)

/// An instruction's first word, and its fields as most formats have them.
struct Decoder::Word {
  Word(std::uint32_t opcode, std::uint32_t pc)
      : o(opcode),
        next(pc + 2),
        d5(static_cast<std::uint8_t>(o >> 4 & 31)),
        r5(static_cast<std::uint8_t>((o >> 5 & 16) | (o & 15))),
        d4(static_cast<std::uint8_t>(16 + (o >> 4 & 15))) {}
  std::uint32_t o, next;    ///< `next`: address of the word after it
  std::uint8_t d5, r5, d4;  ///< registers of five bits, and one of four: 16 to 31
};

namespace {

constexpr Operation kOther{kLibsimavrs, 0, 0, 1, 0};

bool is_long(std::uint32_t opcode) {
  return (opcode & 0xfc0f) == 0x9000 || (opcode & 0xfe0c) == 0x940c;  // LDS and STS; JMP and CALL
}

bool in_ram(std::uint32_t address) { return address >= kRam && address <= kRamEnd; }

/// A jump by a number of words. Towards an address beyond the flash libsimavr goes.
Operation jump(Operation::Kind kind, std::uint32_t next, std::int32_t words, std::uint8_t flag) {
  const std::int64_t to = std::int64_t{next} + 2 * words;
  if (to < 0 || to >= std::int64_t{kFlashOctets}) return kOther;
  return {kind, flag, 0, 1, static_cast<std::uint32_t>(to)};
}

}  // namespace

Decoder::Decoder(const avr_t& avr, const Converter* converter)
    : flash_(avr.flash), has_converter_(converter != nullptr) {
  for (std::uint32_t address = kRegisters; address < kRam; ++address) {
    const auto& one = avr.io[address - kRegisters];
    plain_[address] = one.r.c == nullptr && (one.irq == nullptr || address == kAdcsra) && address != kSreg;
  }
}

std::uint32_t Decoder::second_word(const Word& w) const { return w.next + 2 <= kFlashOctets ? word(w.next) : 0; }

Operation Decoder::skip(Operation::Kind kind, const Word& w, std::uint8_t d, std::uint8_t r) const {
  if (w.next + 4 >= kFlashOctets) return kOther;
  return {kind, d, r, static_cast<std::uint8_t>(is_long(word(w.next)) ? 2 : 1), 0};
}

Operation Decoder::decode(std::uint32_t pc) const {
  const Word w(word(pc), pc);
  const std::uint32_t o = w.o, k8 = (o >> 4 & 0xf0) | (o & 15);
  const auto constant = [&](Operation::Kind kind) { return Operation{kind, w.d4, 0, 1, k8}; };
  switch (o >> 12) {
    case 0x3: return constant(kCpi);
    case 0x4: return constant(kSbci);
    case 0x5: return constant(kSubi);
    case 0x6: return constant(kOri);
    case 0x7: return constant(kAndi);
    case 0x8:
    case 0xa: {
      const std::uint32_t q = (o >> 8 & 0x20) | (o >> 7 & 0x18) | (o & 7);
      const auto base = static_cast<std::uint8_t>((o & 8) != 0 ? kY : kZ);
      return {(o & 0x0200) != 0 ? kStd : kLdd, w.d5, base, 1, q};
    }
    case 0x9: return of_group_9(w);
    case 0xb: return in_or_out(w);
    case 0xc:
    case 0xd: {
      const auto words = static_cast<std::int32_t>((o & 0xfff) ^ 0x800) - 0x800;
      return jump((o & 0x1000) != 0 ? kRcall : kRjmp, w.next, words, 0);
    }
    case 0xe: return constant(kLdi);
    case 0xf: return branch_or_bit(w);
    default: return two_registers(w);
  }
}

Operation Decoder::two_registers(const Word& w) const {
  const std::uint32_t o = w.o;
  if (o == 0) return {kNop, 0, 0, 1, 0};
  if ((o & 0xff00) == 0x0100)
    return {kMovw, static_cast<std::uint8_t>((o >> 4 & 15) * 2), static_cast<std::uint8_t>((o & 15) * 2), 1, 0};
  if ((o & 0xff00) == 0x0200) return {kMuls, w.d4, static_cast<std::uint8_t>(16 + (o & 15)), 1, 0};
  const auto registers = [&](Operation::Kind kind) { return Operation{kind, w.d5, w.r5, 1, 0}; };
  switch (o >> 10) {
    case 0x1: return registers(kCpc);
    case 0x2: return registers(kSbc);
    case 0x3: return registers(kAdd);
    case 0x4: return skip(kCpse, w, w.d5, w.r5);
    case 0x5: return registers(kCp);
    case 0x6: return registers(kSub);
    case 0x7: return registers(kAdc);
    case 0x8: return registers(kAnd);
    case 0x9: return registers(kEor);
    case 0xa: return registers(kOr);
    case 0xb: return registers(kMov);
    default: return kOther;
  }
}

Operation Decoder::in_or_out(const Word& w) const {
  const std::uint32_t address = (w.o >> 5 & 0x30) + (w.o & 15) + 32;
  const bool directions = is_direction(address);
  if ((w.o & 0x0800) != 0) {
    if (directions) return {kWriteDirections, w.d5, 0, 1, address};
    if (address == kSreg) return {kWriteFlags, w.d5, 0, 1, 0};
    const bool is_stack_pointer = (address == kSpl || address == kSph) && plain_[address];
    return is_stack_pointer ? Operation{kWriteStackPointer, w.d5, 0, 1, address} : kOther;
  }
  if (directions || plain_[address]) return {kReadRegister, w.d5, 0, 1, address};
  return address == kSreg ? Operation{kReadFlags, w.d5, 0, 1, 0} : kOther;
}

/// In `d` of a branch: the flag. In `r` of the others: the bit.
Operation Decoder::branch_or_bit(const Word& w) const {
  const auto bit = static_cast<std::uint8_t>(w.o & 7);
  if ((w.o & 0x0800) == 0) {
    const auto words = static_cast<std::int32_t>((w.o >> 3 & 0x7f) ^ 0x40) - 0x40;
    return jump((w.o & 0x0400) != 0 ? kBrbc : kBrbs, w.next, words, bit);
  }
  if ((w.o & 8) != 0) return kOther;
  switch (w.o >> 9 & 3) {
    case 0: return {kBld, w.d5, bit, 1, 0};
    case 1: return {kBst, w.d5, bit, 1, 0};
    case 2: return skip(kSbrc, w, w.d5, bit);
    default: return skip(kSbrs, w, w.d5, bit);
  }
}

Operation Decoder::of_group_9(const Word& w) const {
  if ((w.o & 0x0c00) == 0x0c00) return {kMul, w.d5, w.r5, 1, 0};
  if ((w.o & 0x0e00) == 0x0600) return word_and_constant(w);
  if ((w.o & 0x0800) != 0) return kOther;
  if ((w.o & 0x0e00) == 0x0000) return load(w);
  if ((w.o & 0x0e00) == 0x0200) return store(w);
  return one_register_or_control(w);
}

Operation Decoder::word_and_constant(const Word& w) const {
  const auto pair = static_cast<std::uint8_t>(24 + (w.o >> 3 & 6));
  const std::uint32_t k = (w.o >> 2 & 0x30) | (w.o & 15);
  if ((w.o & 0x0100) == 0) return {kAdiw, pair, 0, 1, k};
  // A delay: SBIW by 1, and BRNE back to it.
  const bool loops = k == 1 && w.next + 2 < kFlashOctets && word(w.next) == 0xf7f1;
  return {loops ? kDelayBySbiw : kSbiw, pair, 0, 1, k};
}

Operation Decoder::load(const Word& w) const {
  const std::uint8_t d5 = w.d5;
  switch (w.o & 15) {
    case 0x0: {
      const std::uint32_t address = second_word(w);
      if (has_converter_ && Converter::is_result(address)) return {kReadConverter, d5, 0, 2, address};
      if (!in_ram(address) && !(address < kRam && plain_[address])) return kOther;
      // A poll: LDS, SBRC or SBRS of a bit of it, and RJMP back. In its `r`: the bit, and its value that goes on polling << 3.
      const std::uint32_t skips = w.next + 6 < kFlashOctets ? word(w.next + 2) : 0;
      const bool polls = (skips & 0xfdf8) == (0xfc00u | std::uint32_t{d5} << 4) && word(w.next + 4) == 0xcffc;
      if (!polls) return {kLds, d5, 0, 2, address};
      return {kPoll, d5, static_cast<std::uint8_t>((skips & 7) | ((skips & 0x0200) != 0 ? 0 : 8)), 2, address};
    }
    case 0x1: return {kLdIncrement, d5, kZ, 1, 0};
    case 0x2: return {kLdDecrement, d5, kZ, 1, 0};
    case 0x4: return {kLpm, d5, 0, 1, 0};
    case 0x5: return {kLpmIncrement, d5, 0, 1, 0};
    case 0x9: return {kLdIncrement, d5, kY, 1, 0};
    case 0xa: return {kLdDecrement, d5, kY, 1, 0};
    case 0xc: return {kLdd, d5, kX, 1, 0};
    case 0xd: return {kLdIncrement, d5, kX, 1, 0};
    case 0xe: return {kLdDecrement, d5, kX, 1, 0};
    case 0xf: return {kPop, d5, 0, 1, 0};
    default: return kOther;
  }
}

Operation Decoder::store(const Word& w) const {
  const std::uint8_t d5 = w.d5;
  switch (w.o & 15) {
    case 0x0: {
      const std::uint32_t address = second_word(w);
      if (has_converter_ && Converter::is_control(address)) return {kWriteConverter, d5, 0, 2, address};
      return in_ram(address) ? Operation{kSts, d5, 0, 2, address} : kOther;
    }
    case 0x1: return {kStIncrement, d5, kZ, 1, 0};
    case 0x2: return {kStDecrement, d5, kZ, 1, 0};
    case 0x9: return {kStIncrement, d5, kY, 1, 0};
    case 0xa: return {kStDecrement, d5, kY, 1, 0};
    case 0xc: return {kStd, d5, kX, 1, 0};
    case 0xd: return {kStIncrement, d5, kX, 1, 0};
    case 0xe: return {kStDecrement, d5, kX, 1, 0};
    case 0xf: return {kPush, d5, 0, 1, 0};
    default: return kOther;
  }
}

Operation Decoder::one_register_or_control(const Word& w) const {
  const std::uint32_t o = w.o;
  switch (o & 15) {
    case 0x0: return {kCom, w.d5, 0, 1, 0};
    case 0x1: return {kNeg, w.d5, 0, 1, 0};
    case 0x2: return {kSwap, w.d5, 0, 1, 0};
    case 0x3: return {kInc, w.d5, 0, 1, 0};
    case 0x5: return {kAsr, w.d5, 0, 1, 0};
    case 0x6: return {kLsr, w.d5, 0, 1, 0};
    case 0x7: return {kRor, w.d5, 0, 1, 0};
    case 0xa: return {kDec, w.d5, 0, 1, 0};
    default: break;
  }
  if ((o & 0xfe0c) == 0x940c) {
    const std::uint32_t to = second_word(w) * 2;
    if ((o & 0x01f1) != 0 || to >= kFlashOctets || w.next + 2 > kFlashOctets) return kOther;
    return {(o & 2) != 0 ? kCall : kJmp, 0, 0, 2, to};
  }
  if ((o & 0xff0f) == 0x9408) {
    const auto flag = static_cast<std::uint8_t>(o >> 4 & 7);
    // While FastCore runs no interrupt waits, so to it CLI is a flag like others.
    if (flag == S_I && (o & 0x80) == 0) return {kEnableInterrupts, 0, 0, 1, 0};
    return {(o & 0x80) != 0 ? kClearFlag : kSetFlag, flag, 0, 1, 0};
  }
  switch (o) {
    case 0x9409: return {kIjmp, 0, 0, 1, 0};
    case 0x9508: return {kRet, 0, 0, 1, 0};
    case 0x9509: return {kIcall, 0, 0, 1, 0};
    case 0x95c8: return {kLpm, 0, 0, 1, 0};
    default: return kOther;
  }
}

}  // namespace kilotwin::firmware
