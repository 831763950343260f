// The fast core against libsimavr: every instruction, from random states.
#include <gtest/gtest.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_core.h>

#include <cstdlib>
#include <cstring>
#include <random>

#include "services/comm/firmware/fast_core.hpp"

namespace kilotwin::firmware {
namespace {

constexpr std::uint32_t kRamEnd = 0x8ff, kData = kRamEnd + 1;

/// A processor of libsimavr without peripherals at work.
class Processor {
 public:
  Processor() : avr_(avr_make_mcu_by_name("atmega328p")) {
    avr_->log = LOG_NONE;
    avr_init(avr_);
  }
  ~Processor() {
    avr_terminate(avr_);
    std::free(avr_);
  }
  Processor(const Processor&) = delete;
  Processor& operator=(const Processor&) = delete;
  avr_t* operator->() const { return avr_; }
  avr_t& operator*() const { return *avr_; }

 private:
  avr_t* avr_;
};

class FastCoreTest : public testing::Test {
 protected:
  /// Registers, RAM and flags at random; pointers and stack within RAM, most of the time.
  void randomise() {
    for (std::uint32_t i = 0; i < kData; ++i)
      if (i < 32 || i >= 0x100) fast_->data[i] = static_cast<std::uint8_t>(random_());
    for (const std::uint32_t pair : {26u, 28u, 30u, 0x5du}) {
      const std::uint32_t address = random_() % 8 == 0 ? random_() & 0xffff : 0x100 + random_() % 0x800;
      fast_->data[pair] = static_cast<std::uint8_t>(address);
      fast_->data[pair + 1] = static_cast<std::uint8_t>(address >> 8);
    }
    if (fast_->data[0x5e] > 8 || fast_->data[0x5e] == 0) fast_->data[0x5e] = 4;  // no stack beyond the memory
    for (int i = 0; i < 7; ++i) fast_->sreg[i] = random_() & 1;
    fast_->sreg[S_I] = 0;
    fast_->cycle = 1000;
    fast_->run_cycle_count = 1;
    fast_->interrupt_state = 0;
    fast_->state = cpu_Running;
    std::memcpy(slow_->data, fast_->data, kData);
    std::memcpy(slow_->sreg, fast_->sreg, sizeof fast_->sreg);
    slow_->cycle = fast_->cycle;
    slow_->run_cycle_count = 1;
    slow_->interrupt_state = 0;
    slow_->state = cpu_Running;
  }
  void put(std::uint32_t address, std::uint32_t word) {
    for (avr_t* avr : {&*fast_, &*slow_}) {
      avr->flash[address] = static_cast<std::uint8_t>(word);
      avr->flash[address + 1] = static_cast<std::uint8_t>(word >> 8);
    }
  }
  void expect_equal(std::uint32_t opcode, avr_flashaddr_t slow_pc) {
    ASSERT_EQ(fast_->pc, slow_pc) << std::hex << opcode;
    ASSERT_EQ(fast_->cycle, slow_->cycle) << std::hex << opcode;
    ASSERT_EQ(fast_->interrupt_state, slow_->interrupt_state) << std::hex << opcode;
    ASSERT_EQ(std::memcmp(fast_->sreg, slow_->sreg, sizeof fast_->sreg), 0) << std::hex << opcode;
    if (std::memcmp(fast_->data, slow_->data, kData) == 0) return;
    for (std::uint32_t i = 0; i < kData; ++i)
      ASSERT_EQ(fast_->data[i], slow_->data[i]) << std::hex << opcode << " at " << i;
  }

  Processor fast_, slow_;
  std::mt19937 random_{20};
};

TEST_F(FastCoreTest, EachInstructionLeavesTheSameState) {
  constexpr std::uint32_t kPlace = 0x1000;
  int executed = 0;
  FastCore core(*fast_);
  for (std::uint32_t opcode = 0; opcode < 0x10000; ++opcode) {
    for (int round = 0; round < 6; ++round) {
      randomise();
      put(kPlace, opcode);
      put(kPlace + 2, random_() % 2 == 0 ? 0x100 + random_() % 0x800 : random_() & 0xffff);
      put(kPlace + 4, random_() & 0xffff);
      put(kPlace + 6, random_() & 0xffff);
      core.forget(kPlace, 8);
      fast_->pc = slow_->pc = kPlace;
      for (const int port : {0x24, 0x27, 0x2a}) {  // settled as after a write, without pull-ups
        for (avr_t* avr : {&*fast_, &*slow_}) avr->data[port + 1] &= avr->data[port];
      }
      if (core.run(*fast_, 1).passed == 0) continue;
      ++executed;
      expect_equal(opcode, avr_run_one(&*slow_));
      if (HasFatalFailure()) return;
    }
  }
  EXPECT_GT(executed, 6 * 50000) << "most instructions are executed";
}

TEST_F(FastCoreTest, DelaysTakeTheSameCycles) {
  constexpr std::uint32_t kPlace = 0x200;
  for (const std::uint32_t count : {0u, 1u, 2u, 3u, 2000u, 0x7fffu, 0x8000u, 0x8001u, 0xffffu}) {
    for (const std::uint64_t budget : {1u, 2u, 3u, 4u, 5u, 8u, 2047u, 2048u, 8001u, 300000u}) {
      randomise();
      put(kPlace, 0x9701);      // sbiw r24, 1
      put(kPlace + 2, 0xf7f1);  // brne back to it
      put(kPlace + 4, 0xcfff);  // rjmp to itself
      FastCore core(*fast_);
      for (avr_t* avr : {&*fast_, &*slow_}) {
        avr->data[24] = static_cast<std::uint8_t>(count);
        avr->data[25] = static_cast<std::uint8_t>(count >> 8);
        avr->pc = kPlace;
      }
      const std::uint64_t passed = core.run(*fast_, budget).passed;
      EXPECT_EQ(passed, fast_->cycle - 1000);
      slow_->run_cycle_count = budget;
      expect_equal(count, avr_run_one(&*slow_));
      if (HasFatalFailure()) return;
    }
  }
}

TEST_F(FastCoreTest, PollsTakeTheSameCycles) {
  constexpr std::uint32_t kPlace = 0x200, kPolled = 0x7a;
  for (const std::uint32_t skips : {0xfd86u, 0xff86u, 0xfd96u}) {  // sbrc r24, 6; sbrs r24, 6; sbrc r25, 6
    for (const std::uint64_t budget : {1u, 2u, 3u, 4u, 5u, 6u, 10u, 11u, 2047u}) {
      randomise();
      put(kPlace, 0x9180);  // lds r24
      put(kPlace + 2, kPolled);
      put(kPlace + 4, skips);
      put(kPlace + 6, 0xcffc);  // rjmp back
      put(kPlace + 8, 0xcfff);  // rjmp to itself
      FastCore core(*fast_);
      for (avr_t* avr : {&*fast_, &*slow_}) {
        avr->data[kPolled] = 0x40;
        avr->pc = kPlace;
      }
      core.run(*fast_, budget);
      slow_->run_cycle_count = budget;
      expect_equal(skips, avr_run_one(&*slow_));
      if (HasFatalFailure()) return;
    }
  }
}

TEST_F(FastCoreTest, ForgetsPagesThatAreWritten) {
  put(0x400, 0xe001);  // ldi r16, 1
  put(0x402, 0x95a8);  // wdr: libsimavr's
  FastCore core(*fast_);
  fast_->pc = 0x400;
  fast_->interrupt_state = 0;
  EXPECT_EQ(core.run(*fast_, 100).passed, 1u);
  EXPECT_EQ(fast_->data[16], 1);
  put(0x400, 0xe002);
  core.forget(0x400, 128);
  fast_->pc = 0x400;
  core.run(*fast_, 100);
  EXPECT_EQ(fast_->data[16], 2);
}

}  // namespace
}  // namespace kilotwin::firmware
