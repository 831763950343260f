/// The analogue-to-digital converter of libsimavr's ATmega328P, for FastCore: what a program does for each reading of a sensor,
/// without libsimavr's signals. Registers, timers and results are the same in every bit. Rare cases are left to libsimavr:
/// the first conversion, interrupts at a conversion's end, free running.
#pragma once

#include <cstdint>
#include <functional>

struct avr_t;
struct avr_adc_t;

namespace kilotwin::firmware {

class Converter {
 public:
  /// `sample` is called where a conversion begins: it sets the voltages. The processor must outlive this object, and no conversion
  /// has begun yet.
  Converter(avr_t&, std::function<void()> sample);

  /// ADMUX and ADCSRA.
  [[nodiscard]] static bool is_control(std::uint32_t address) {
    return address == kMultiplexer || address == kControl;
  }
  /// ADCL and ADCH.
  [[nodiscard]] static bool is_result(std::uint32_t address) {
    return address == kResultLow || address == kResultHigh;
  }

  /// An instruction that begins at this cycle writes to a control register. Returns the cycles from then on for which nothing
  /// else changes because of it; 0: nothing is done, and libsimavr must execute the instruction.
  [[nodiscard]] std::uint64_t write(avr_t&, std::uint64_t cycle, std::uint32_t address, std::uint8_t value) const;
  /// A program reads a result register.
  [[nodiscard]] std::uint8_t read(avr_t&, std::uint32_t address) const;
  /// Ends a conversion, if one is the first thing that is due. libsimavr must do so where an interrupt follows.
  void end_due(avr_t&) const;
  /// For `sample`: the voltage at an input, ADC_IRQ_ADC0 to ADC_IRQ_ADC7 and ADC_IRQ_TEMP.
  void set_voltage(int input, std::uint32_t millivolts) const;

 private:
  // Addresses in data space (data sheet of the ATmega328P, register summary).
  static constexpr std::uint32_t kResultLow = 0x78, kResultHigh = 0x79, kControl = 0x7a, kTriggers = 0x7b,
                                 kMultiplexer = 0x7c;

  avr_adc_t* converter_ = nullptr;
  std::function<void()> sample_;
  /// libsimavr's function for a conversion's end.
  std::uint64_t (*end_)(avr_t*, std::uint64_t, void*) = nullptr;
};

}  // namespace kilotwin::firmware
