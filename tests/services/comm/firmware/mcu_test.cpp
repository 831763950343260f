// One processor and its board.
#include "services/comm/firmware/mcu.hpp"

#include <gtest/gtest.h>

#include <array>
#include <random>

#include "core/base/error.hpp"
#include "services/comm/firmware/eeprom.hpp"
#include "services/comm/packet_bits.hpp"
#include "tests/services/comm/firmware/programs.hpp"

namespace kilotwin::firmware {
namespace {

constexpr OwnCycles kSecond = 8'000'000;
constexpr Calibration kDuties{60, 61, 70, 71};
const RangingTable kNominal{KILOTWIN_IR_HIGH, KILOTWIN_IR_LOW};

Mcu make(const FlashImage& image, std::uint32_t robot = 5) {
  return Mcu(image, make_eeprom(static_cast<std::uint16_t>(robot), kDuties, kNominal), Random(1), robot);
}

/// The light pulses of a message that starts at a cycle.
std::vector<Light> light(std::uint8_t type, OwnCycles at, std::int16_t high = 627, std::int16_t low = 464,
                         std::uint8_t first = 0) {
  IrMessage message{};
  message[0] = first;
  message[9] = type;
  const comm::PacketBits bits = comm::packet_bits(message);
  std::vector<Light> pulses;
  for (std::size_t b = 0; b < bits.size(); ++b) {
    if (bits[b]) pulses.push_back({at + b * comm::kBit, high, low});
  }
  return pulses;
}

void tell(Mcu& mcu, std::uint8_t type) { mcu.run(mcu.now() + kSecond / 20, light(type, mcu.now() + 1000)); }

enum : std::uint8_t { kReset = 0x83, kSleep = 0x84, kWakeup = 0x85, kRun = 0x88 };

const FlashImage& talker() {
  static const FlashImage image = firmware(whole_program(
      "static message_t hello; static uint8_t heard, distance;\n"
      "static message_t* send(void) { return &hello; }\n"
      "static void receive(message_t* m, distance_measurement_t* d) { ++heard; distance = estimate_distance(d); "
      "set_color(m->data[0] & 63); }\n"
      "static void setup(void) { hello.data[3] = 0xa5; hello.crc = message_crc(&hello); }\n"
      "static void loop(void) { set_motors(heard, distance); }\n",
      "kilo_message_tx = send; kilo_message_rx = receive;"));
  return image;
}

TEST(Mcu, RunsOnCommandAndDrivesMotorsAndLed) {
  Mcu mcu =
      make(firmware(whole_program("static void setup(void) { set_color(RGB(1, 2, 3)); }\n"
                                  "static void loop(void) { set_motors(kilo_turn_left, kilo_straight_right); }")));
  mcu.run(kSecond / 2, {});
  EXPECT_EQ(mcu.outputs().motor_left, 0);
  tell(mcu, kRun);
  EXPECT_EQ(mcu.outputs().motor_left, kDuties.turn_left);
  EXPECT_EQ(mcu.outputs().motor_right, kDuties.straight_right);
  EXPECT_EQ(mcu.outputs().led, 1 | 2 << 2 | 3 << 4);
  tell(mcu, kWakeup);
  EXPECT_EQ(mcu.outputs().motor_left, 0) << "paused";
}

/// A program that uses the converter's registers and the interrupt flag in any order.
const char* const kUsesOfTheConverter =
    "static uint8_t n; static volatile uint16_t sum, ends;\n"
    "ISR(ADC_vect) { sum += ADCL; sum += ADCH << 8; ++ends; ADCSRA &= ~_BV(ADIE); }\n"
    "static void wait(void) { while (ADCSRA & _BV(ADSC)) {} }\n"
    "static void one(uint8_t mux, uint8_t control) { ADMUX = mux; ADCSRA = control; wait(); sum += ADC; }\n"
    "static void setup(void) {}\n"
    "static void loop(void) {\n"
    "  switch (n++ % 14) {\n"
    "    case 0: one(0x46, 0xc3); break;\n"
    "    case 1: ADCSRA = 0xc3; ADCSRA = 0xc3; ADMUX = 0x47; ADCSRA = 0x83; wait(); sum += ADC; break;\n"
    "    case 2: ADCSRA = 0; one(0x47, 0xc4); one(0x47, 0xc4); break;\n"
    "    case 3: ADMUX = 0x46; ADCSRA = 0xcb; break;\n"
    "    case 4: one(0x47, 0xc2); sum += ADCH; sum += ADCL; break;\n"
    "    case 5: one(0x67, 0xc3); sum += ADCH; break;\n"
    "    case 6: ADCSRB = 0; ADCSRA = 0xe3; for (uint8_t i = 0; i < 60; ++i) sum += ADC;\n"
    "      ADCSRA = 0xc3; wait(); ADCSRB = 1; break;\n"
    "    case 7: cli(); sum += TCNT0; sei(); ++sum; sei(); ++sum; cli(); sei(); cli(); sei(); break;\n"
    "    case 8: ADMUX = 0x40; ADCSRA = 0xa3; for (uint8_t i = 0; i < 200; ++i) sum += ADCSRA; break;\n"
    "    case 9: one(0xc8, 0xc7); break;\n"
    "    case 10: one(0x46, 0xc0); one(0x46, 0xc1); break;\n"
    "    case 11: ADCSRA = 0xc3; ADCSRA = 0x03; ADCSRA = 0x83; ADCSRA = 0xc3; ADCSRA = 0x93; wait(); break;\n"
    "    case 12: for (uint8_t i = 0; i < 100; ++i) { const uint8_t flags = SREG; cli(); ++sum; SREG = flags; } "
    "break;\n"
    "    default: one(0x47, 0xd3); ADCSRA = 0xd3; for (uint8_t i = 0; i < 9; ++i) sum += ADC; wait(); sum += ADC;\n"
    "  }\n"
    "  set_motors(sum, ends); }";

/// All that a robot shows and holds is the same at any time, whatever executes its instructions.
TEST(Mcu, TheFastCoreAgreesWithLibsimavr) {
  const FlashImage programs[] = {
      talker(),
      firmware("#define DEBUG\n#include <debug.h>\n" +
               whole_program(
                   "static uint16_t n; static void setup(void) { debug_init(); rand_seed(rand_hard()); }\n"
                   "static void loop(void) { set_motors(rand_soft(), get_ambientlight() >> 2); set_color(n++);\n"
                   "  printf(\"%u \", n); delay(n % 50); if (n % 7 == 0) spinup_motors(); }")),
      firmware(whole_program(
          "static volatile float sum; static int32_t table[20];\n"
          "static void receive(message_t* m, distance_measurement_t* d) { delay(3); sum += m->data[0] / 3.0f; }\n"
          "static void setup(void) {}\n"
          "static void loop(void) { for (uint8_t i = 1; i < 20; ++i) table[i] = table[i - 1] * 7 / (i + 1) - "
          "kilo_ticks;\n"
          "  sum = sum * 0.5f + table[19]; set_motors(table[7], sum); }",
          "kilo_message_rx = receive;")),
      firmware("#include <avr/interrupt.h>\n#include <avr/io.h>\n" + whole_program(kUsesOfTheConverter))};
  senses::Readings readings{};
  readings.light = 300;
  readings.light_sd = 4;
  readings.voltage = 700;
  readings.voltage_sd = 3;
  for (const FlashImage& program : programs) {
    const auto eeprom = make_eeprom(5, kDuties, kNominal);
    Mcu fast(program, eeprom, Random(1), 5), slow(program, eeprom, Random(1), 5, Mcu::Core::kLibsimavr);
    fast.set_readings(readings);
    slow.set_readings(readings);
    std::mt19937 random(8);
    for (int span = 0; span < 4000; ++span) {
      std::vector<Light> pulses;
      if (span == 20) pulses = light(kRun, fast.now() + 500);
      if (span > 100 && span % 40 == 0)
        pulses = light(0, fast.now() + random() % 2000, 600, 400, static_cast<std::uint8_t>(span));
      const OwnCycles until = fast.now() + (pulses.empty() ? 1 + random() % 2048 : 60'000);
      fast.run(until, pulses);
      slow.run(until, pulses);
      ASSERT_EQ(fast.now(), slow.now()) << span;
      ASSERT_EQ(fast.program_counter(), slow.program_counter()) << span;
      const Outputs a = fast.outputs(), b = slow.outputs();
      ASSERT_TRUE(a.motor_left == b.motor_left && a.motor_right == b.motor_right && a.led == b.led) << span;
      for (int address = 0; address < 0x900; ++address)
        ASSERT_EQ(fast.memory(static_cast<std::uint16_t>(address)),
                  slow.memory(static_cast<std::uint16_t>(address)))
            << span << " at " << address;
    }
    EXPECT_EQ(fast.flashes(), slow.flashes());
    EXPECT_EQ(fast.printed(), slow.printed());
    EXPECT_EQ(fast.eeprom(), slow.eeprom());
    EXPECT_NE(fast.outputs().motor_left + fast.outputs().motor_right, 0) << "it runs";
  }
}

/// Programs that wait are only counted, not executed: at any cycle they are nevertheless where libsimavr has them. Here nobody
/// looks at their memory for many spans, and some spans are repeated with other light.
TEST(Mcu, ProgramsThatWaitAreWhereLibsimavrHasThem) {
  const std::string rx =
      "static volatile uint8_t heard; static volatile uint32_t sum; static void setup(void) {}\n"
      "static void receive(message_t* m, distance_measurement_t* d) { heard = m->data[0] + 1; }\n";
  const FlashImage programs[] = {
      firmware(whole_program(rx + "static void loop(void) { if (kilo_ticks / 15 % 3 == heard % 3) set_color(1); }",
                             "kilo_message_rx = receive;")),
      firmware(whole_program(rx + "static void loop(void) { while (!heard); set_color(heard); heard = 0; ++sum; }",
                             "kilo_message_rx = receive;")),
      firmware(whole_program(rx + "static void loop(void) { sum += get_ambientlight(); set_color(sum >> 4); }",
                             "kilo_message_rx = receive;")),
      firmware("#include <avr/io.h>\n" +
               whole_program(
                   rx + "static void loop(void) { ADMUX = 0x47; ADCSRA = 0xc7; uint8_t first, second;\n"
                        "  do { first = ADCSRA; second = ADCSRA; } while (first & second & 0x40); sum += ADC; }",
                   "kilo_message_rx = receive;"))};
  senses::Readings readings{};
  readings.light = 300;
  readings.light_sd = 4;
  for (const FlashImage& program : programs) {
    const auto eeprom = make_eeprom(5, kDuties, kNominal);
    Mcu fast(program, eeprom, Random(1), 5), slow(program, eeprom, Random(1), 5, Mcu::Core::kLibsimavr);
    fast.set_readings(readings);
    slow.set_readings(readings);
    std::mt19937 random(9);
    for (int span = 0; span < 2000; ++span) {
      std::vector<Light> pulses;
      if (span == 20) pulses = light(kRun, fast.now() + 500);
      if (span > 100 && span % 60 == 0)
        pulses = light(0, fast.now() + random() % 2000, 600, 400, static_cast<std::uint8_t>(span));
      const OwnCycles until = fast.now() + (pulses.empty() ? 1 + random() % 4096 : 60'000);
      fast.mark();
      if (span % 3 == 0) {
        fast.run(until, span % 6 == 0 ? light(0, fast.now() + random() % 900) : std::vector<Light>());
        fast.rewind();
      }
      fast.run(until, pulses);
      slow.run(until, pulses);
      ASSERT_EQ(fast.now(), slow.now()) << span;
      if (span % 25 != 0) continue;
      ASSERT_EQ(fast.program_counter(), slow.program_counter()) << span;
      for (int address = 0; address < 0x900; ++address)
        ASSERT_EQ(fast.memory(static_cast<std::uint16_t>(address)),
                  slow.memory(static_cast<std::uint16_t>(address)))
            << span << " at " << address;
    }
  }
}

TEST(PulseDecoder, APacketWithAWrongCrcIsWholeAndSaysSo) {
  IrMessage message{};
  message[3] = 0xa5;
  for (const std::uint16_t error : std::array<std::uint16_t, 3>{0, 1, 0x8001}) {
    const comm::PacketBits bits =
        comm::packet_bits(message, static_cast<std::uint16_t>(comm::message_crc(message) ^ error));
    comm::PulseDecoder decoder(comm::kTimerCounts * comm::kTimerCount);
    auto last = comm::PulseDecoder::Event::kNone;
    for (std::size_t bit = 0; bit < comm::kPacketBits; ++bit) {
      if (!bits[bit]) continue;
      const auto time = static_cast<comm::Cycles>(bit) * comm::kBit;
      EXPECT_EQ(decoder.pass(time, true), comm::PulseDecoder::Event::kNone);
      last = decoder.feed(time);
    }
    ASSERT_EQ(last, comm::PulseDecoder::Event::kReceived) << error;
    EXPECT_EQ(decoder.packet().message, message);
    EXPECT_EQ(decoder.packet().crc_error, error);
  }
}

TEST(Mcu, SendsWholePacketsEverySixteenTicks) {
  Mcu mcu = make(talker());
  mcu.run(kSecond / 2, {});
  tell(mcu, kRun);
  mcu.clear_flashes();
  mcu.run(mcu.now() + 20 * kSecond, {});
  comm::PulseDecoder decoder(comm::kTimerCounts * comm::kTimerCount);
  std::vector<comm::Cycles> starts, ends;
  for (const OwnCycles flash : mcu.flashes()) {
    const auto time = static_cast<comm::Cycles>(flash);
    EXPECT_EQ(decoder.pass(time, true), comm::PulseDecoder::Event::kNone);
    const auto event = decoder.feed(time);
    if (event == comm::PulseDecoder::Event::kStarted) starts.push_back(time);
    if (event != comm::PulseDecoder::Event::kReceived) continue;
    ends.push_back(time);
    EXPECT_EQ(decoder.packet().message[3], 0xa5);
    EXPECT_EQ(decoder.packet().crc_error, 0);
  }
  ASSERT_EQ(starts.size(), 38u);
  ASSERT_EQ(ends.size(), 38u);
  for (std::size_t i = 0; i < starts.size(); ++i) {
    EXPECT_NEAR(static_cast<double>(ends[i] - starts[i]), static_cast<double>(comm::kPacket - comm::kBit), 200);
    if (i > 0) {
      EXPECT_NEAR(static_cast<double>(starts[i] - starts[i - 1]), 16.0 * 262144, 500);
    }
  }
}

TEST(Mcu, MeasuresTheDistanceOfASender) {
  Mcu mcu = make(talker());
  mcu.run(kSecond / 2, {});
  tell(mcu, kRun);
  // Entry 4 of the ranging table: 20 mm beyond contact.
  mcu.run(mcu.now() + kSecond / 20, light(0, mcu.now() + 1000, 627, 464, 9));
  EXPECT_EQ(mcu.outputs().motor_left, 1);
  EXPECT_NEAR(mcu.outputs().motor_right, 33 + 20, 2);
  EXPECT_EQ(mcu.outputs().led, 9);
}

TEST(Mcu, HearsASenderWhoseClockIsTwoPercentOff) {
  for (const double rate : {0.98, 1.02}) {
    Mcu mcu = make(talker());
    mcu.run(kSecond / 2, {});
    std::vector<Light> pulses = light(0, mcu.now() + 1000);
    const OwnCycles start = pulses[0].at;
    for (Light& pulse : pulses)
      pulse.at = start + static_cast<OwnCycles>(static_cast<double>(pulse.at - start) * rate);
    mcu.run(mcu.now() + kSecond / 20, pulses);
    tell(mcu, kRun);
    EXPECT_EQ(mcu.outputs().motor_left, 1) << rate;
  }
}

TEST(Mcu, GivesUpWhenItDetectsAnotherPacket) {
  Mcu mcu = make(talker());
  mcu.run(kSecond / 2, {});
  tell(mcu, kRun);
  mcu.mark();
  mcu.clear_flashes();
  mcu.run(mcu.now() + kSecond, {});
  const OwnCycles start = mcu.flashes().front();
  EXPECT_GT(mcu.flashes().size(), 20u);
  for (const auto& [after, gives_up] :
       {std::pair<OwnCycles, bool>{300, false}, {700, true}, {2300, true}, {3000, false}}) {
    mcu.rewind();
    mcu.clear_flashes();
    mcu.run(start + 30000, std::vector<Light>{{start + after, 500, 400}});
    EXPECT_EQ(mcu.flashes().front(), start);
    EXPECT_EQ(mcu.flashes().size() == 1, gives_up) << after;
  }
}

TEST(Mcu, ResultDoesNotDependOnTheSpansOfRuns) {
  const auto run = [](std::uint32_t seed) {
    Mcu mcu = make(talker());
    std::mt19937 random(seed);
    std::vector<Light> all;
    for (OwnCycles at : {400000u, 900000u, 1300000u, 1500000u}) {
      for (const Light& pulse : light(at == 400000u ? kRun : 0, at)) all.push_back(pulse);
    }
    std::size_t next = 0;
    while (mcu.now() < 3 * kSecond) {
      const OwnCycles until =
          std::min<OwnCycles>(3 * kSecond, mcu.now() + 1 + random() % (seed == 0 ? 10 * kSecond : 5000));
      std::size_t last = next;
      while (last < all.size() && all[last].at < until) ++last;
      mcu.run(until, std::span(all).subspan(next, last - next));
      next = last;
    }
    return std::pair(mcu.save(), mcu.flashes());
  };
  const auto whole = run(0);
  EXPECT_GT(whole.second.size(), 50u);
  EXPECT_EQ(run(1), whole);
  EXPECT_EQ(run(2), whole);
}

TEST(Mcu, ReturnsToTheLastCommitAndContinuesFromASavedState) {
  Mcu mcu = make(talker());
  mcu.run(kSecond / 2, {});
  tell(mcu, kRun);
  mcu.mark();
  const std::string before = mcu.save();
  mcu.run(mcu.now() + 2 * kSecond, {});
  const std::string after = mcu.save();
  EXPECT_NE(before, after);
  mcu.rewind();
  EXPECT_EQ(mcu.save(), before);
  Mcu other = make(talker());
  other.run(kSecond / 3, {});
  other.load(before);
  EXPECT_EQ(other.save(), before);
  EXPECT_EQ(other.now(), mcu.now());
  mcu.run(mcu.now() + 2 * kSecond, {});
  other.run(other.now() + 2 * kSecond, {});
  EXPECT_EQ(mcu.save(), after);
  EXPECT_EQ(other.save(), after);
  EXPECT_LT(after.size(), 20000u);
  EXPECT_THROW(other.load(before.substr(0, before.size() / 2)), RunError);
}

TEST(Mcu, StopsAtAFaultAndReportsTheAddress) {
  Mcu mcu =
      make(firmware(whole_program("static void setup(void) { __asm__ volatile(\".word 0xff0f\\n.word "
                                  "0x9409\\n.word 0x0001\\n.word 0x95a7\"); }\n"
                                  "static void loop(void) { __asm__ volatile(\".word 0x940b\"); }")));
  mcu.run(kSecond / 2, {});
  tell(mcu, kRun);
  // An illegal instruction or a jump out of the flash affects this robot only.
  mcu.run(mcu.now() + kSecond, {});
  EXPECT_GE(mcu.now(), kSecond);
  Mcu wild = make(firmware(whole_program(
      "static void setup(void) {} static void loop(void) { *(volatile uint8_t*)0xabcd = 1; set_motors(9, 9); }")));
  wild.run(kSecond / 2, {});
  tell(wild, kRun);
  EXPECT_EQ(wild.halt(), Halt::kBadAddress);
  EXPECT_EQ(wild.outputs().motor_left, 0);
  EXPECT_NE(wild.program_counter(), 0u);
  EXPECT_FALSE(wild.listening());
}

TEST(Mcu, SleepsWithItsClocksOffAndWakesAfterEightSeconds) {
  Mcu mcu = make(talker());
  mcu.run(kSecond / 2, {});
  tell(mcu, kSleep);
  EXPECT_FALSE(mcu.listening());
  bool white = false;
  for (int i = 0; i < 200; ++i) {
    mcu.run(mcu.now() + kSecond / 20, light(kWakeup, mcu.now() + 100));
    white = white || mcu.outputs().led == 63;
  }
  EXPECT_TRUE(mcu.listening()) << "a copy fell into the moment in which it listens";
  tell(mcu, kRun);
  mcu.clear_flashes();
  mcu.run(mcu.now() + kSecond, {});
  EXPECT_FALSE(mcu.flashes().empty());
}

TEST(Mcu, DrawsRandomBitsFromConverterNoise) {
  Mcu mcu =
      make(firmware(whole_program("static void setup(void) {}\n"
                                  "static void loop(void) { set_motors(rand_hard(), 0); delay(1); }")));
  mcu.run(kSecond / 2, {});
  tell(mcu, kRun);
  // Number of ones among 8 x 1000 bits: 4000 +- 45; the bound is 6 standard deviations.
  int ones = 0;
  std::vector<int> seen(256, 0);
  for (int i = 0; i < 1000; ++i) {
    mcu.run(mcu.now() + kSecond / 100, {});
    ones += __builtin_popcount(mcu.outputs().motor_left);
    seen[mcu.outputs().motor_left] = 1;
  }
  EXPECT_NEAR(ones, 4000, 270);
  EXPECT_GT(std::count(seen.begin(), seen.end(), 1), 200);
}

TEST(Mcu, PrintsOnItsSerialPort) {
  Mcu mcu = make(firmware("#define DEBUG\n#include <debug.h>\n" +
                          whole_program("static void setup(void) { printf(\"robot %u\\n\", kilo_uid); }\n"
                                        "static void loop(void) {}",
                                        "debug_init();")));
  mcu.run(kSecond / 2, {});
  tell(mcu, kRun);
  EXPECT_EQ(mcu.printed(), "robot 5\n");
}

TEST(Mcu, StoresItsCalibration) {
  Mcu mcu = make(talker());
  mcu.run(kSecond / 2, {});
  IrMessage message{};
  const auto send = [&](std::initializer_list<std::uint8_t> data) {
    message = {};
    std::copy(data.begin(), data.end(), message.begin());
    message[9] = 0x8a;
    const comm::PacketBits bits = comm::packet_bits(message);
    std::vector<Light> pulses;
    for (std::size_t b = 0; b < bits.size(); ++b) {
      if (bits[b]) pulses.push_back({mcu.now() + 1000 + b * comm::kBit, 500, 400});
    }
    mcu.run(mcu.now() + kSecond / 5, pulses);
  };
  send({2, 0, 0, 99});  // turn left at 99
  EXPECT_EQ(mcu.outputs().motor_left, 99);
  send({0});  // save
  EXPECT_EQ(mcu.eeprom()[0x05], 99);
}

/// An image of these instructions, followed by erased flash.
FlashImage image_of(const std::vector<std::uint16_t>& words) {
  FlashImage image;
  image.flash.fill(0xff);
  for (std::size_t i = 0; i < words.size(); ++i) {
    image.flash[2 * i] = static_cast<std::uint8_t>(words[i] & 0xff);
    image.flash[2 * i + 1] = static_cast<std::uint8_t>(words[i] >> 8);
  }
  image.used_octets = static_cast<std::uint32_t>(2 * words.size());
  return image;
}

TEST(Mcu, ExtendedLoadsAreIllegalInstructions) {
  // elpm r0, Z; elpm r16, Z; elpm r16, Z+: libsimavr takes the upper octet of the address from r0, here 255.
  for (const std::uint16_t elpm : {std::uint16_t{0x95d8}, std::uint16_t{0x9106}, std::uint16_t{0x9107}}) {
    Mcu mcu = make(image_of({0xef0f /* ldi r16, 255 */, 0x2e00 /* mov r0, r16 */, elpm}));
    mcu.run(100, {});
    EXPECT_EQ(mcu.halt(), Halt::kIllegalInstruction);
    EXPECT_EQ(mcu.program_counter(), 4u);
  }
}

TEST(Mcu, EepromAddressesHaveTenBits) {
  const FlashImage image = firmware(
      "#include <avr/io.h>\nint main(void) {\n"
      "  EEAR = 0xfc10; EEDR = 0x5a; EECR = _BV(EEMPE); EECR |= _BV(EEPE);\n"
      "  while (EECR & _BV(EEPE)); EEAR = 0xa810; EECR |= _BV(EERE);\n"
      "  DDRB = 8; PORTB = EEDR == 0x5a ? 8 : 0; for (;;); }\n");
  Mcu mcu = make(image);
  mcu.run(kSecond / 10, {});
  EXPECT_EQ(mcu.eeprom()[0x10], 0x5a);
  EXPECT_EQ(mcu.outputs().motor_left, 255);
}

TEST(Mcu, NoProgramAffectsAnotherProcessor) {
  // Random instructions, and a real program with changed octets: each runs or stops its own robot and affects no other.
  std::mt19937 random(3);
  const FlashImage& real = talker();
  int halted = 0;
  for (int n = 0; n < 400; ++n) {
    FlashImage image = real;
    if (n % 2 == 0) {
      for (std::uint8_t& octet : image.flash) octet = static_cast<std::uint8_t>(random());
      // Half of all instructions have addresses: loads, stores, jumps, calls, I/O.
      for (std::size_t at = 1; at < image.flash.size(); at += 4)
        image.flash[at] = static_cast<std::uint8_t>(0x90 + random() % 0x30);
    } else {
      for (int i = 0; i < 40; ++i) image.flash[random() % real.used_octets] = static_cast<std::uint8_t>(random());
    }
    Mcu mcu = make(image);
    for (int k = 0; k < 4; ++k) mcu.run(mcu.now() + 40'000, light(kRun, mcu.now() + 1000));
    halted += mcu.halt() != Halt::kNone ? 1 : 0;
    EXPECT_EQ(mcu.now() >= 160'000, true);
    // Any resulting state must be valid for save and load.
    Mcu other = make(image);
    other.load(mcu.save());
    EXPECT_EQ(other.now(), mcu.now());
  }
  EXPECT_GT(halted, 100);
}

}  // namespace
}  // namespace kilotwin::firmware
