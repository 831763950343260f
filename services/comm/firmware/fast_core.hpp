/// The instructions of the AVR core that touch registers and RAM alone, decoded once and executed on libsimavr's own state. All
/// others, above all those on I/O registers, are left to libsimavr. The state after any number of instructions is the same in every
/// bit as with libsimavr; tests/services/comm/firmware/fast_core_test.cpp compares both.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "services/comm/firmware/flash_image.hpp"

struct avr_t;

namespace kilotwin::firmware {

class FastCore {
 public:
  /// `flash`: the program. It must outlive this object; forget() says where it changes.
  explicit FastCore(const std::uint8_t* flash);

  /// Executes instructions while fewer than `cycles` have passed, and stops before the first that is libsimavr's. Returns the number
  /// of cycles. The caller makes sure that no interrupt waits and that the processor runs.
  std::uint64_t run(avr_t& avr, std::uint64_t cycles);
  /// A page of the flash has been erased or written.
  void forget(std::uint32_t address, std::uint32_t octets);

 private:
  struct Operation {
    std::uint8_t kind = 0, d = 0, r = 0, words = 1;
    std::uint32_t k = 0;  ///< a constant, an address in RAM, or an address in flash in octets
  };
  [[nodiscard]] Operation decode(std::uint32_t pc) const;
  [[nodiscard]] std::uint32_t word(std::uint32_t pc) const {
    return flash_[pc] | std::uint32_t{flash_[pc + 1]} << 8;
  }

  const std::uint8_t* flash_;
  std::unique_ptr<std::array<Operation, kFlashOctets / 2>> operations_;
};

}  // namespace kilotwin::firmware
