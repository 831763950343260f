/// A simulated Kilobot board: the ATmega328P (by libsimavr), infrared transmitter and receiver, motors, LED, sensors, EEPROM.
/// Source of pins and registers: kilolib and the Kilobot's circuit.
///
/// Time is counted in cycles of the robot's own oscillator since it was switched on. The result depends only on the cycles at
/// which light arrives. It does not depend on how the time is divided into calls of run().
///
/// Added here, because libsimavr 1.6 lacks them: conversions that the comparator starts, interrupt vectors in the boot section
/// (IVSEL); program addresses that wrap at the end of the flash, power-down that stops all clocks but the watchdog's, and the
/// time that erasing and writing a page of flash takes.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/base/motor_phases.h"
#include "core/random/random.hpp"
#include "core/senses/robot_senses.hpp"
#include "services/comm/firmware/converter.hpp"
#include "services/comm/firmware/fast_core.hpp"
#include "services/comm/firmware/flash_image.hpp"

struct avr_t;
struct avr_io_t;
struct avr_irq_t;

namespace kilotwin::firmware {

using OwnCycles = std::uint64_t;

/// An infrared pulse at the receiver, as the two amplifiers give it to the converter, in 10-bit counts.
struct Light {
  OwnCycles at;
  std::int16_t high_gain, low_gain;
};

struct Outputs {
  std::uint8_t motor_left = 0, motor_right = 0;  ///< duty
  std::uint8_t led = 0;                          ///< r | g << 2 | b << 4
};

/// Why a robot has stopped for good.
enum class Halt : std::uint8_t {
  kNone = 0,
  kIllegalInstruction = 1,
  kBadAddress = 2,  ///< the program accessed an address without memory, or ran beyond the end of the flash
  kEnded = 3,       ///< the program returned from main, or sleeps with interrupts disabled: not a fault
  kFlat = 4         ///< the battery is empty: not a fault
};

class Mcu {
 public:
  /// The simulator of instructions: libsimavr alone, or FastCore for those that it knows. The results are equal.
  enum class Core : std::uint8_t { kFast, kLibsimavr };
  /// A robot that is switched on at cycle 0. The random stream of `robot` gives the noise of its converter.
  Mcu(const FlashImage&, const std::array<std::uint8_t, kEepromOctets>& eeprom, const Random&, std::uint32_t robot,
      Core = Core::kFast);
  ~Mcu();
  Mcu(const Mcu&) = delete;
  Mcu& operator=(const Mcu&) = delete;

  /// Runs to the first instruction boundary at or after `until`. `light`: ascending, not before now().
  void run(OwnCycles until, std::span<const Light> light);
  [[nodiscard]] OwnCycles now() const;
  /// Sets the readings of its sensors from now on.
  void set_readings(const senses::Readings&);
  /// The battery runs empty; the battery is charged again. Memory and registers are lost, the EEPROM is kept.
  void power_off();
  void power_on();

  /// Rising edges of the infrared LED since the last clear, ascending.
  [[nodiscard]] const std::vector<OwnCycles>& flashes() const { return flashes_; }
  void clear_flashes() { flashes_.clear(); }
  /// The text that it wrote to its serial port (38400 baud, PD1) since the last clear.
  [[nodiscard]] std::string& printed() { return printed_; }

  [[nodiscard]] Outputs outputs() const;
  /// The motors since the last call, and the duties at the end: where full duty of both motors goes on and is younger than the
  /// last call, those before it.
  struct MotorUse {
    OwnCycles full_cycles = 0;  ///< for how long both motors had full duty
    std::uint8_t left = 0, right = 0;
    KilotwinMotorPhases phases{};  ///< of the time without full duty of both; empty: the duties did not change
  };
  [[nodiscard]] MotorUse take_motors();
  [[nodiscard]] Halt halt() const { return state_.halt; }
  /// Whether it can receive: it is neither halted nor asleep with its clocks off.
  [[nodiscard]] bool listening() const;
  /// Address in flash, octets, of the next instruction, or of the instruction at which it stopped.
  [[nodiscard]] std::uint32_t program_counter() const;

  /// mark() saves the present state in memory, and rewind() restores it. flashes() and printed() are not part of the state.
  void mark();
  void rewind();

  /// The state as octets, for another process of the same build.
  [[nodiscard]] std::string save() const;
  /// Restores the state of a robot that was constructed with the same arguments. Throws RunError if the octets do not fit.
  void load(const std::string& octets);

  /// Own memory, as the program sees it: address 0x100 is the first of RAM.
  [[nodiscard]] std::uint8_t memory(std::uint16_t address) const;
  [[nodiscard]] std::array<std::uint8_t, kEepromOctets> eeprom() const;
  /// The program in flash: that of the image, unless a boot loader has written pages.
  [[nodiscard]] std::span<const std::uint8_t, kFlashOctets> flash() const;

 private:
  static constexpr OwnCycles kNever = std::numeric_limits<OwnCycles>::max();
  /// The part of the state that libsimavr does not hold.
  struct State {
    OwnCycles dark_at = kNever;     ///< when the receiver's pulse ends
    OwnCycles powered_down = 0;     ///< cycles that the processor's clock has missed
    std::uint32_t conversions = 0;  ///< number of conversions, each with its own noise
    std::uint32_t fault_at = 0;
    Halt halt = Halt::kNone;
    // Motors. Full duty of both counts from full_since on; `steady` are the duties that held before a change for longer than it
    // takes to write both.
    OwnCycles motors_from = 0, full_since = kNever, full_cycles = 0, changed_at = 0;
    std::uint8_t left = 0, right = 0, steady_left = 0, steady_right = 0, before_left = 0, before_right = 0;
    KilotwinMotorPhases phases{};  ///< since motors_from; empty whenever the state is saved
  };
  /// A range of memory that changes while the processor runs.
  struct Range {
    std::uint8_t* begin;
    std::size_t octets;
  };

  /// A page of flash before it was erased or written.
  struct Page {
    std::uint32_t address;
    std::array<std::uint8_t, kPageOctets> octets;
  };

  void execute(OwnCycles until);
  void put_page(std::uint32_t address, const std::uint8_t* octets);
  void keep_page(std::uint32_t address);
  void run_burst(OwnCycles budget);
  void power_down(OwnCycles until);
  void doze(OwnCycles until);
  void serve_interrupts();
  void interrupt_core();
  void settle() const;
  void return_to_pristine();
  void after_reset();
  void hold_charger();
  void set_receiver(bool lit);
  void start_conversion();
  [[nodiscard]] std::vector<Range> ranges() const;

  void note_motors();
  void add_phase();
  static void on_motor(avr_irq_t*, std::uint32_t value, void* mcu);
  static void on_led(avr_irq_t*, std::uint32_t value, void* mcu);
  static void on_conversion(avr_irq_t*, std::uint32_t, void* mcu);
  static void on_serial(avr_irq_t*, std::uint32_t octet, void* mcu);
  static int on_flash(avr_io_t*, std::uint32_t request, void* parameter);
  static void on_log(avr_t*, int level, const char* format, void* arguments);
  friend struct LogHook;

  avr_t* avr_;
  std::unique_ptr<Converter> fast_converter_;  ///< null: libsimavr executes everything
  std::unique_ptr<FastCore> core_;             ///< as fast_converter_
  const Random random_;
  const std::uint32_t robot_;
  senses::Readings readings_;
  State state_, marked_state_;
  std::vector<OwnCycles> flashes_;
  std::string printed_;
  void* watchdog_ = nullptr;  ///< libsimavr's module, as libsimavr's timers name it
  int (*write_flash_)(avr_io_t*, std::uint32_t, void*) = nullptr;  ///< libsimavr's own on_flash()
  std::array<avr_irq_t*, 2> comparator_{};
  avr_irq_t* converter_ = nullptr;
  std::vector<avr_irq_t*> lines_;       ///< all of libsimavr's signals
  std::vector<Range> ranges_;           ///< all that changes but signals and flash
  std::vector<std::uint8_t> marked_;    ///< contents of the ranges, then of the signals
  std::vector<Page> replaced_;          ///< pages written since the mark, with their content at the mark
  std::vector<std::uint8_t> pristine_;  ///< ranges and signals at cycle 0
  const std::array<std::uint8_t, kFlashOctets> program_;  ///< content of the flash at cycle 0
};

}  // namespace kilotwin::firmware
