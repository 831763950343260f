/// Decodes instructions of the AVR core from flash into operations that FastCore executes.
#pragma once

#include <bitset>
#include <cstdint>

#include "services/comm/firmware/converter.hpp"
#include "services/comm/firmware/flash_image.hpp"

struct avr_t;

namespace kilotwin::firmware {

/// Addresses in data space (data sheet of the ATmega328P).
namespace data_space {
/// DDRB, DDRC and DDRD; the PORT register follows each.
inline constexpr std::uint32_t kDdrB = 0x24, kDdrC = 0x27, kDdrD = 0x2a;
inline constexpr std::uint32_t kX = 26, kY = 28, kZ = 30, kSpl = 0x5d, kSph = 0x5e, kSreg = 0x5f;
/// The converter's control register, which programs poll. libsimavr computes the comparator's output anew at each read of it, with
/// the same result.
inline constexpr std::uint32_t kAdcsra = 0x7a;
/// The first I/O register; the first octet of RAM and the last one.
inline constexpr std::uint32_t kRegisters = 0x20, kRam = 0x100, kRamEnd = 0x8ff;

[[nodiscard]] constexpr bool is_direction(std::uint32_t address) {
  return address == kDdrB || address == kDdrC || address == kDdrD;
}
}  // namespace data_space

/// A decoded instruction, or a short sequence of instructions that programs wait with.
struct Operation {
  /// A kind names the instruction of the AVR instruction set manual. Loads and stores through X, Y and Z are kLdd and kStd.
  enum Kind : std::uint8_t {
    kUnknown,  ///< not decoded yet
    kLibsimavrs,
    kNop,
    kMovw,
    kMul,
    kMuls,
    kCpc,
    kSbc,
    kAdd,
    kCpse,
    kCp,
    kSub,
    kAdc,
    kAnd,
    kEor,
    kOr,
    kMov,
    kCpi,
    kSbci,
    kSubi,
    kOri,
    kAndi,
    kLdd,
    kStd,
    kLdIncrement,
    kLdDecrement,
    kStIncrement,
    kStDecrement,
    kLds,
    kSts,
    kPush,
    kPop,
    kCom,
    kNeg,
    kSwap,
    kInc,
    kAsr,
    kLsr,
    kRor,
    kDec,
    kJmp,
    kCall,
    kRjmp,
    kRcall,
    kRet,
    kIjmp,
    kIcall,
    kAdiw,
    kSbiw,
    kLdi,
    kBrbs,
    kBrbc,
    kSbrc,
    kSbrs,
    kBst,
    kBld,
    kSetFlag,
    kClearFlag,
    kLpm,
    kLpmIncrement,
    kReadRegister,
    kWriteDirections,
    kReadFlags,
    kWriteFlags,
    kEnableInterrupts,
    kWriteStackPointer,
    kReadConverter,
    kWriteConverter,
    kDelayBySbiw,
    kPoll
  };
  Kind kind = kUnknown;
  std::uint8_t d = 0, r = 0;  ///< registers; of `d` or `r` also a flag or a bit, as the decoder says
  std::uint8_t words = 1;     ///< length of the instruction; of kCpse, kSbrc and kSbrs that of the next one
  std::uint32_t k = 0;        ///< a constant, an address in RAM, or an address in flash in octets
};

class Decoder {
 public:
  /// Processor and converter must outlive this object, and its peripherals must be complete. Without a converter, its registers are
  /// libsimavr's.
  explicit Decoder(const avr_t&, const Converter* = nullptr);

  /// The instruction at an address in flash, octets; even, below kFlashOctets.
  [[nodiscard]] Operation decode(std::uint32_t pc) const;
  /// Whether an I/O register is read without effect.
  [[nodiscard]] bool is_plain(std::uint32_t address) const { return plain_[address]; }

 private:
  struct Word;
  [[nodiscard]] Operation two_registers(const Word&) const;
  [[nodiscard]] Operation in_or_out(const Word&) const;
  [[nodiscard]] Operation branch_or_bit(const Word&) const;
  [[nodiscard]] Operation of_group_9(const Word&) const;
  [[nodiscard]] Operation word_and_constant(const Word&) const;
  [[nodiscard]] Operation load(const Word&) const;
  [[nodiscard]] Operation store(const Word&) const;
  [[nodiscard]] Operation one_register_or_control(const Word&) const;
  [[nodiscard]] Operation skip(Operation::Kind, const Word&, std::uint8_t d, std::uint8_t r) const;
  [[nodiscard]] std::uint32_t word(std::uint32_t pc) const {
    return flash_[pc] | std::uint32_t{flash_[pc + 1]} << 8;
  }
  /// The second word of an instruction, an address; 0 beyond the flash.
  [[nodiscard]] std::uint32_t second_word(const Word&) const;

  const std::uint8_t* flash_;
  const bool has_converter_;
  std::bitset<0x100> plain_;
};

}  // namespace kilotwin::firmware
