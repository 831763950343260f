// Operations of single instructions. fast_core_test.cpp compares their effects with libsimavr's, for every instruction.
#include "services/comm/firmware/decoder.hpp"

#include <gtest/gtest.h>
#include <simavr/sim_avr.h>

#include <cstdlib>
#include <initializer_list>

namespace kilotwin::firmware {

static void PrintTo(const Operation& o, std::ostream* out) {
  *out << "kind " << int{o.kind} << ", d " << int{o.d} << ", r " << int{o.r} << ", words " << int{o.words} << ", k "
       << o.k;
}
static bool operator==(const Operation& a, const Operation& b) {
  return a.kind == b.kind && a.d == b.d && a.r == b.r && a.words == b.words && a.k == b.k;
}

namespace {

class DecoderTest : public testing::Test {
 protected:
  DecoderTest() : avr_(avr_make_mcu_by_name("atmega328p")) {
    avr_->log = LOG_NONE;
    avr_init(avr_);
  }
  ~DecoderTest() override {
    avr_terminate(avr_);
    std::free(avr_);
  }
  DecoderTest(const DecoderTest&) = delete;
  DecoderTest& operator=(const DecoderTest&) = delete;
  /// The operation of these words, at this address.
  Operation of(std::initializer_list<std::uint32_t> words, std::uint32_t pc = 0x1000) {
    std::uint32_t at = pc;
    for (const std::uint32_t word : words) {
      avr_->flash[at++] = static_cast<std::uint8_t>(word);
      avr_->flash[at++] = static_cast<std::uint8_t>(word >> 8);
    }
    return Decoder(*avr_).decode(pc);
  }

  avr_t* avr_;
  const Operation other_{Operation::kLibsimavrs, 0, 0, 1, 0};
};

// The opcodes are those of the AVR instruction set manual.
TEST_F(DecoderTest, RegistersAndConstants) {
  EXPECT_EQ(of({0x0000}), (Operation{Operation::kNop, 0, 0, 1, 0}));
  EXPECT_EQ(of({0x0fef}), (Operation{Operation::kAdd, 30, 31, 1, 0})) << "add r30, r31";
  EXPECT_EQ(of({0x01fe}), (Operation{Operation::kMovw, 30, 28, 1, 0})) << "movw r30, r28";
  EXPECT_EQ(of({0x0214}), (Operation{Operation::kMuls, 17, 20, 1, 0})) << "muls r17, r20";
  EXPECT_EQ(of({0xeaf5}), (Operation{Operation::kLdi, 31, 0, 1, 0xa5})) << "ldi r31, 0xa5";
  EXPECT_EQ(of({0x96ff}), (Operation{Operation::kAdiw, 30, 0, 1, 63})) << "adiw r30, 63";
  EXPECT_EQ(of({0xfb27}), (Operation{Operation::kBst, 18, 7, 1, 0})) << "bst r18, 7";
}

TEST_F(DecoderTest, LoadsAndStores) {
  EXPECT_EQ(of({0x802f}), (Operation{Operation::kLdd, 2, 28, 1, 7})) << "ldd r2, Y+7";
  EXPECT_EQ(of({0xae07}), (Operation{Operation::kStd, 0, 30, 1, 63})) << "std Z+63, r0";
  EXPECT_EQ(of({0x900c}), (Operation{Operation::kLdd, 0, 26, 1, 0})) << "ld r0, X";
  EXPECT_EQ(of({0x93df}), (Operation{Operation::kPush, 29, 0, 1, 0})) << "push r29";
  EXPECT_EQ(of({0x9180, 0x0123}), (Operation{Operation::kLds, 24, 0, 2, 0x123})) << "lds r24, 0x123";
  EXPECT_EQ(of({0x9180, 0x0900}), other_) << "beyond the RAM";
  EXPECT_EQ(of({0x9380, 0x08ff}), (Operation{Operation::kSts, 24, 0, 2, 0x8ff})) << "sts 0x8ff, r24";
  EXPECT_EQ(of({0x9380, 0x00ff}), other_) << "a register that may have effects";
}

TEST_F(DecoderTest, JumpsStayInTheFlash) {
  EXPECT_EQ(of({0xcfff}), (Operation{Operation::kRjmp, 0, 0, 1, 0x1000})) << "rjmp to itself";
  EXPECT_EQ(of({0xf7f9}), (Operation{Operation::kBrbc, 1, 0, 1, 0x1000})) << "brne to itself";
  EXPECT_EQ(of({0x940e, 0x3fff}), (Operation{Operation::kCall, 0, 0, 2, 0x7ffe})) << "call 0x7ffe";
  EXPECT_EQ(of({0x940e, 0x4000}), other_) << "call 0x8000";
  EXPECT_EQ(of({0xcffd}, 0), other_) << "rjmp to before the flash";
  EXPECT_EQ(of({0xc001}, 0x7ffc), other_) << "rjmp to behind the flash";
}

TEST_F(DecoderTest, ASkipKnowsTheLengthOfTheNextInstruction) {
  EXPECT_EQ(of({0xff83, 0x0000}), (Operation{Operation::kSbrs, 24, 3, 1, 0})) << "sbrs r24, 3; nop";
  EXPECT_EQ(of({0xff83, 0x9180, 0x0123}), (Operation{Operation::kSbrs, 24, 3, 2, 0})) << "sbrs r24, 3; lds";
  EXPECT_EQ(of({0x1389, 0x940e, 0x0000}), (Operation{Operation::kCpse, 24, 25, 2, 0})) << "cpse r24, r25; call";
  EXPECT_EQ(of({0xff83}, 0x7ffe), other_) << "at the end of the flash";
}

TEST_F(DecoderTest, WaitsAreOneOperation) {
  EXPECT_EQ(of({0x9701, 0xf7f1}), (Operation{Operation::kDelayBySbiw, 24, 0, 1, 1})) << "sbiw r24, 1; brne to it";
  EXPECT_EQ(of({0x9701, 0xf7e9}), (Operation{Operation::kSbiw, 24, 0, 1, 1})) << "brne elsewhere";
  EXPECT_EQ(of({0x9702, 0xf7f1}), (Operation{Operation::kSbiw, 24, 0, 1, 2})) << "sbiw r24, 2";
  EXPECT_EQ(of({0x9180, 0x0123, 0xff80, 0xcffc}), (Operation{Operation::kPoll, 24, 0, 2, 0x123}))
      << "lds; sbrs r24, 0; rjmp to it: goes on while the bit is 0";
  EXPECT_EQ(of({0x9180, 0x0123, 0xfd82, 0xcffc}), (Operation{Operation::kPoll, 24, 2 | 8, 2, 0x123}))
      << "sbrc r24, 2: while it is 1";
  EXPECT_EQ(of({0x9180, 0x0123, 0xff90, 0xcffc}), (Operation{Operation::kLds, 24, 0, 2, 0x123}))
      << "another register";
}

TEST_F(DecoderTest, InterruptsAndFlags) {
  EXPECT_EQ(of({0x9478}), (Operation{Operation::kEnableInterrupts, 0, 0, 1, 0})) << "sei";
  EXPECT_EQ(of({0x94f8}), (Operation{Operation::kClearFlag, 7, 0, 1, 0})) << "cli";
  EXPECT_EQ(of({0x9408}), (Operation{Operation::kSetFlag, 0, 0, 1, 0})) << "sec";
  EXPECT_EQ(of({0xb78f}), (Operation{Operation::kReadFlags, 24, 0, 1, 0})) << "in r24, SREG";
  EXPECT_EQ(of({0xbf8f}), (Operation{Operation::kWriteFlags, 24, 0, 1, 0})) << "out SREG, r24";
  EXPECT_EQ(of({0x9518}), other_) << "reti";
  EXPECT_EQ(of({0x9588}), other_) << "sleep";
}

}  // namespace
}  // namespace kilotwin::firmware
