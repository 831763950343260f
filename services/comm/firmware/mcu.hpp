/// One robot's ATmega328P with what the Kilobot's board puts around it, simulated by libsimavr: infrared light in and out,
/// motors, LED, sensors, EEPROM. Source of pins and registers: kilolib and the Kilobot's circuit.
///
/// Time is counted in cycles of the robot's own oscillator since it was switched on. What it does depends on the cycles at
/// which light arrives and on nothing else: not on how a span of time is cut into calls of run().
///
/// Bridged here, as libsimavr 1.6 lacks them: conversions that the comparator starts, interrupt vectors in the boot section
/// (IVSEL), program addresses that wrap at the end of the flash, power-down that stops all clocks but the watchdog's, and the
/// time that erasing and writing a page of flash takes.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/random/random.hpp"
#include "core/senses/robot_senses.hpp"
#include "services/comm/firmware/flash_image.hpp"

struct avr_t;
struct avr_io_t;
struct avr_irq_t;

namespace kilotwin::firmware {

using OwnCycles = std::uint64_t;

/// A pulse of light on the receiver and what the two amplifiers make of it, 10-bit ADC counts.
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
  kBadAddress = 2,  ///< it read or wrote where there is no memory, or ran out of the flash
  kEnded = 3,       ///< its program has returned from main, or sleeps with interrupts off: no fault
  kFlat = 4         ///< its battery is empty: no fault
};

class Mcu {
 public:
  /// Switched on, at cycle 0. The random numbers of `robot` are the noise of its converter.
  Mcu(const FlashImage&, const std::array<std::uint8_t, kEepromOctets>& eeprom, const Random&, std::uint32_t robot);
  ~Mcu();
  Mcu(const Mcu&) = delete;
  Mcu& operator=(const Mcu&) = delete;

  /// Runs to the first instruction boundary at or after `until`. `light`: ascending, not before now().
  void run(OwnCycles until, std::span<const Light> light);
  [[nodiscard]] OwnCycles now() const;
  /// What its sensors give from now on.
  void set_readings(const senses::Readings&);
  /// Its battery is empty; it is charged again. What memory and registers held is lost, the EEPROM stays.
  void power_off();
  void power_on();

  /// Rising edges of the infrared LED since the last clear, ascending.
  [[nodiscard]] const std::vector<OwnCycles>& flashes() const { return flashes_; }
  void clear_flashes() { flashes_.clear(); }
  /// What it has written to its serial port (38400 baud, PD1) since the last clear.
  [[nodiscard]] std::string& printed() { return printed_; }

  [[nodiscard]] Outputs outputs() const;
  [[nodiscard]] Halt halt() const { return state_.halt; }
  /// Whether its comparator works: it is neither halted nor asleep with its clocks off.
  [[nodiscard]] bool listening() const;
  /// Address in flash, octets, of the instruction that it is at or at which it stopped.
  [[nodiscard]] std::uint32_t program_counter() const;

  /// Remembers the present state in memory; rewind() goes back to it. What the LED flashed and what was printed is not part of
  /// it.
  void mark();
  void rewind();

  /// The state as octets, for another process that runs the same build.
  [[nodiscard]] std::string save() const;
  /// Into a robot that was made with the same arguments. Throws RunError where the octets do not fit.
  void load(const std::string& octets);

  /// Own memory, as the program sees it: address 0x100 is the first of RAM.
  [[nodiscard]] std::uint8_t memory(std::uint16_t address) const;
  [[nodiscard]] std::array<std::uint8_t, kEepromOctets> eeprom() const;
  /// The program in flash: that of the image, unless a boot loader has written pages.
  [[nodiscard]] std::span<const std::uint8_t, kFlashOctets> flash() const;

 private:
  static constexpr OwnCycles kNever = std::numeric_limits<OwnCycles>::max();
  /// What libsimavr does not keep.
  struct State {
    OwnCycles dark_at = kNever;     ///< when the receiver's pulse ends
    OwnCycles powered_down = 0;     ///< cycles that the processor's clock has missed
    std::uint32_t conversions = 0;  ///< that took noise
    std::uint32_t fault_at = 0;
    Halt halt = Halt::kNone;
  };
  /// A range of octets that changes as it runs.
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
  void after_reset();
  void hold_charger();
  void set_receiver(bool lit);
  void start_conversion();
  [[nodiscard]] std::vector<Range> ranges() const;

  static void on_led(avr_irq_t*, std::uint32_t value, void* mcu);
  static void on_conversion(avr_irq_t*, std::uint32_t, void* mcu);
  static void on_serial(avr_irq_t*, std::uint32_t octet, void* mcu);
  static int on_flash(avr_io_t*, std::uint32_t request, void* parameter);
  static void on_log(avr_t*, int level, const char* format, void* arguments);
  friend struct LogHook;

  avr_t* avr_;
  const Random random_;
  const std::uint32_t robot_;
  senses::Readings readings_;
  State state_, marked_state_;
  std::vector<OwnCycles> flashes_;
  std::string printed_;
  void* watchdog_ = nullptr;                                       ///< libsimavr's module, as its timers name it
  int (*write_flash_)(avr_io_t*, std::uint32_t, void*) = nullptr;  ///< libsimavr's own on_flash()
  std::array<avr_irq_t*, 2> comparator_{};
  avr_irq_t* converter_ = nullptr;
  std::vector<avr_irq_t*> lines_;                         ///< all of libsimavr's signals
  std::vector<Range> ranges_;                             ///< all that changes but signals and flash
  std::vector<std::uint8_t> marked_;                      ///< the ranges, then the signals
  std::vector<Page> replaced_;                            ///< pages written since the mark, as of the mark
  std::vector<std::uint8_t> pristine_;                    ///< the same as of cycle 0
  const std::array<std::uint8_t, kFlashOctets> program_;  ///< flash as of cycle 0
};

}  // namespace kilotwin::firmware
