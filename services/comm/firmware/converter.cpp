#include "services/comm/firmware/converter.hpp"

#include <simavr/avr_adc.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_cycle_timers.h>
#include <simavr/sim_io.h>
#include <simavr/sim_time.h>

#include <cstring>
#include <limits>
#include <utility>

#include "core/base/error.hpp"

namespace kilotwin::firmware {
namespace {

// Bits of ADCSRA; of ADCSRB ADTS2..0; of ADMUX MUX3..0 and ADLAR.
constexpr unsigned kOn = 0x80, kBegins = 0x40, kTriggered = 0x20, kEnded = 0x10, kInterrupting = 0x08,
                   kClockBits = 0x07;
constexpr unsigned kSourceBits = 0x07, kInput = 0x0f, kToTheLeft = 0x20;
/// Clocks of the converter for a conversion that is not the first one.
constexpr std::uint32_t kClocks = 13;

}  // namespace

Converter::Converter(avr_t& avr, std::function<void()> sample) : sample_(std::move(sample)) {
  for (avr_io_t* module = avr.io_port; module != nullptr; module = module->next) {
    if (std::strcmp(module->kind, "adc") == 0) converter_ = reinterpret_cast<avr_adc_t*>(module);
  }
  KILOTWIN_DEMAND(converter_ != nullptr);
  // libsimavr does not export the function. A conversion that begins and is given up shows it.
  const auto& control = avr.io[AVR_DATA_TO_IO(kControl)].w;
  control.c(&avr, kControl, kOn | kBegins, control.param);
  for (const avr_cycle_timer_slot_t* timer = avr.cycle_timers.timer; timer != nullptr; timer = timer->next) {
    if (timer->param == converter_) end_ = timer->timer;
  }
  control.c(&avr, kControl, 0, control.param);
  converter_->first = 0;
  KILOTWIN_DEMAND(end_ != nullptr);
}

std::uint64_t Converter::write(avr_t& avr, std::uint64_t cycle, std::uint32_t address, std::uint8_t value) const {
  std::uint8_t* const data = avr.data;
  const unsigned control = data[kControl];
  // While the converter stays on, the comparator has the same inputs: its output needs no computation. One that is due is not over.
  const avr_cycle_timer_slot_t* const next = avr.cycle_timers.timer;
  if ((control & kOn) == 0 || (next != nullptr && next->when <= cycle + 1)) return 0;
  constexpr std::uint64_t kForEver = std::numeric_limits<std::uint64_t>::max() / 2;
  if (address == kMultiplexer) {
    data[kMultiplexer] = value;
    return kForEver;
  }
  if ((control & kBegins) != 0 || (value & kOn) == 0 || converter_->adts_mode != avr_adts_none) return 0;
  // Without a source of triggers, conversions follow each other. Other sources are not libsimavr's.
  if ((value & kTriggered) != 0 && (data[kTriggers] & kSourceBits) == 0) return 0;
  if ((value & kBegins) != 0 && converter_->first != 0) return 0;
  if ((value & kBegins) == 0) {
    data[kControl] = value;
    return kForEver;
  }
  avr_cycle_timer_pool_t& pool = avr.cycle_timers;
  avr_cycle_timer_slot_t* const timer = pool.timer_free;
  if (timer == nullptr) return 0;
  data[kControl] = value;
  sample_();
  const unsigned shift = value & kClockBits;
  const std::uint32_t clock = avr.frequency >> (shift == 0 ? 1 : shift);
  const avr_cycle_count_t cycles = avr_hz_to_cycles(&avr, clock / kClocks);
  // As avr_cycle_timer_register(): behind all that are due as early.
  pool.timer_free = timer->next;
  *timer = {nullptr, cycle + cycles, end_, converter_};
  avr_cycle_timer_slot_t** place = &pool.timer;
  while (*place != nullptr && (*place)->when <= timer->when) place = &(*place)->next;
  timer->next = *place;
  *place = timer;
  return cycles;
}

void Converter::end_due(avr_t& avr) const {
  avr_cycle_timer_pool_t& pool = avr.cycle_timers;
  avr_cycle_timer_slot_t* const timer = pool.timer;
  if (timer == nullptr || timer->when > avr.cycle || timer->param != converter_) return;
  const unsigned control = avr.data[kControl];
  if ((control & kOn) == 0 || (control & kInterrupting) != 0 || converter_->adts_mode != avr_adts_none ||
      converter_->adc.pending != 0)
    return;
  pool.timer = timer->next;
  timer->next = pool.timer_free;
  pool.timer_free = timer;
  avr.data[kControl] = static_cast<std::uint8_t>((control | kEnded) & ~kBegins);
  converter_->first = converter_->read_status = 0;
}

void Converter::set_voltage(int input, std::uint32_t millivolts) const {
  const auto value = static_cast<std::uint16_t>(millivolts);
  if (input == ADC_IRQ_TEMP)
    converter_->temp = value;
  else
    converter_->adc_values[input] = value;
}

std::uint8_t Converter::read(avr_t& avr, std::uint32_t address) const {
  constexpr std::uint8_t kFresh = 0, kLowRead = 1, kHighRead = 2;
  constexpr std::uint32_t kMost = 0x3ff;
  std::uint8_t* const data = avr.data;
  if (converter_->read_status == kFresh) {
    const unsigned multiplexer = data[kMultiplexer];
    const std::uint32_t reference = converter_->ref_values[multiplexer >> 6] == ADC_VREF_AVCC ? avr.avcc : 0;
    const avr_adc_mux_t input = converter_->muxmode[multiplexer & kInput];
    const std::uint32_t counts = reference != 0 && input.kind == ADC_MUX_SINGLE
                                     ? converter_->adc_values[input.src] * kMost / reference
                                     : kMost + 1;
    if (counts > kMost) {
      const auto& result = avr.io[AVR_DATA_TO_IO(address)].r;
      return data[address] = result.c(&avr, static_cast<avr_io_addr_t>(address), result.param);
    }
    const std::uint32_t shifted = (multiplexer & kToTheLeft) != 0 ? counts << 6 : counts;
    data[kResultLow] = static_cast<std::uint8_t>(shifted);
    data[kResultHigh] = static_cast<std::uint8_t>(shifted >> 8);
    converter_->read_status = kLowRead;
  }
  if (address == kResultHigh && converter_->read_status == kLowRead) converter_->read_status = kHighRead;
  return data[address];
}

}  // namespace kilotwin::firmware
