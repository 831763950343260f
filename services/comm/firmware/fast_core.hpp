/// Instructions of the AVR core, decoded once (decoder.hpp) and executed on libsimavr's own state: those that touch registers, RAM, I/O registers
/// without effects, the flag of interrupts, or the analogue converter. All others are left to libsimavr. The state after any number
/// of instructions is the same in every bit as with libsimavr; tests/services/comm/firmware/fast_core_test.cpp compares both.
///
/// A program that waits comes back to the same state of registers and RAM again and again, until an interrupt or an I/O register
/// changes. The core finds such a loop, and from then on only counts its cycles. The registers and RAM in `avr` are then those at
/// the loop's beginning: call settle() before they are read or written.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "services/comm/firmware/converter.hpp"
#include "services/comm/firmware/decoder.hpp"
#include "services/comm/firmware/flash_image.hpp"

struct avr_t;

namespace kilotwin::firmware {

class FastCore {
 public:
  /// Processor and converter must outlive this object, and its peripherals must be complete; forget() says where its flash
  /// changes. Without a converter, its registers are libsimavr's.
  explicit FastCore(const avr_t&, const Converter* = nullptr);

  struct Run {
    std::uint64_t passed;  ///< cycles; fewer than `due` if the next instruction is libsimavr's
    std::uint64_t due;     ///< the given cycles, or fewer if an instruction has scheduled something
  };
  /// Executes instructions while fewer than `cycles` have passed and nothing is due, and stops before the first that is libsimavr's.
  /// The caller makes sure that no interrupt waits and that the processor runs.
  Run run(avr_t&, std::uint64_t cycles);
  /// Brings registers, RAM and program counter up to the present cycle.
  void settle(avr_t&);
  /// As settle(), before something else than run() changes registers, RAM or program counter.
  void interrupt(avr_t&);
  /// A page of the flash has been erased or written.
  void forget(std::uint32_t address, std::uint32_t octets);

  /// The part of the state that `avr` lacks: mark() saves it, and rewind() restores it.
  void mark() { marked_ = waiting_; }
  void rewind();

 private:
  /// Registers, I/O registers, RAM and flags.
  struct Memory {
    std::array<std::uint8_t, 0x900> data;
    std::array<std::uint8_t, 8> flags;
  };
  /// A loop that comes back to the same state after to_boundary.size() cycles.
  struct Loop {
    Memory begin;
    std::vector<std::uint8_t> to_boundary;  ///< per cycle of the loop: cycles until an instruction begins
  };
  /// The program is `phase` cycles into a loop.
  struct Waiting {
    std::shared_ptr<const Loop> loop;  ///< null: it is in none
    std::uint32_t phase = 0;
  };
  static constexpr std::uint32_t kNowhere = 0xffffffffu;
  /// Short waits are not worth a copy of the state.
  static constexpr std::uint32_t kFirstPatience = 32;
  /// A state that the program may come back to. No instruction of libsimavr and no interrupt came since (Brent 1980).
  struct Anchor {
    std::uint32_t pc = kNowhere;
    std::uint64_t cycle = 0;
    std::uint32_t jumps = 0;  ///< backward ones since
    std::uint32_t patience =
        kFirstPatience;  ///< number of backward jumps after which a later state replaces this one
    Memory memory;
  };

  template <bool kSeeksLoops> Run execute(avr_t&, std::uint64_t cycles);
  [[nodiscard]] bool inputs_are(const avr_t&, const Memory&) const;
  [[nodiscard]] bool is_back(const avr_t&) const;
  void set_anchor(const avr_t&, std::uint32_t pc, std::uint64_t cycle);
  void enter_loop(avr_t&, std::uint32_t period);
  std::uint64_t skip(avr_t&, std::uint64_t cycles);
  void forget_anchor() { anchor_.pc = kNowhere, anchor_.jumps = 0, anchor_.patience = kFirstPatience; }

  const Decoder decoder_;
  const Converter* converter_;
  std::array<std::uint8_t, 0x100> inputs_{};  ///< 0xff for I/O registers that operations read but never change
  /// Per word of the flash. The last stands behind its end.
  using Operations = std::array<Operation, kFlashOctets / 2 + 1>;
  std::unique_ptr<Operations> operations_;
  Anchor anchor_;
  Waiting waiting_, marked_;
};

}  // namespace kilotwin::firmware
