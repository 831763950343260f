#include "services/comm/firmware/mcu.hpp"

#include <simavr/avr_acomp.h>
#include <simavr/avr_adc.h>
#include <simavr/avr_eeprom.h>
#include <simavr/avr_extint.h>
#include <simavr/avr_flash.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_timer.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_core.h>
#include <simavr/sim_io.h>

#include <algorithm>
#include <cstdarg>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <utility>

#include "core/base/error.hpp"

namespace kilotwin::firmware {
namespace {

/// How long a pulse of light keeps the comparator up: as long as a Kilobot's LED is on.
constexpr OwnCycles kPulse = 9;
/// Voltages at the comparator, mV: above AIN1 means light.
constexpr std::uint32_t kThreshold_mV = 1000, kLit_mV = 2000;
/// libsimavr converts mV to counts of Vref / 1023. With this reference a count is 10 mV, whatever AVCC a real robot has.
constexpr std::uint32_t kReference_mV = 10230, kInternalReference_mV = 1100, kCounts = 1023;

// Addresses of registers in data space (data sheet of the ATmega328P, register summary).
enum Register : std::uint16_t {
  kDdrB = 0x24,
  kPortB = 0x25,
  kDdrC = 0x27,
  kPortC = 0x28,
  kDdrD = 0x2a,
  kPortD = 0x2b,
  kEearh = 0x42,
  kSmcr = 0x53,
  kMcucr = 0x55,
  kSpmcsr = 0x57,
  kAdcsra = 0x7a,
  kAdcsrb = 0x7b,
  kAdmux = 0x7c,
  kTccr2a = 0xb0,
  kOcr2a = 0xb3,
  kOcr2b = 0xb4
};
constexpr std::uint8_t kSleepMode = 0x0e, kPowerDown = 0x04;         // SMCR: SM2..0
constexpr std::uint8_t kIvsel = 0x02;                                // MCUCR
constexpr std::uint8_t kAutoTrigger = 0x20;                          // ADCSRA: ADATE
constexpr std::uint8_t kTriggerSource = 0x07, kByComparator = 0x01;  // ADCSRB: ADTS2..0
constexpr std::uint8_t kChannel = 0x0f, kReference = 0xc0;           // ADMUX: MUX3..0, REFS1..0
constexpr std::uint8_t kSelfProgramming = 0x01, kPageWrite = 0x04,
                       kPageErase = 0x02;  // SPMCSR: SELFPRGEN, PGWRT, PGERS
constexpr int kPointerZ = 30;              // r30, r31
/// How long erasing or writing a page takes, cycles: 4 ms (data sheet: 3.7 to 4.5 ms).
constexpr avr_cycle_count_t kPageTime = 32000;
/// Where the Kilobot's boot loader begins (fuses BOOTSZ = 2048 words).
constexpr std::uint32_t kBootSection = 0x7000;

/// The program counter can name 128 KiB; the flash repeats there.
constexpr std::uint32_t kProgramSpace = 128 * 1024;
/// Number of addresses of 16 bits. libsimavr writes there before it says that there is no memory.
constexpr std::uint32_t kDataSpace = 64 * 1024;

/// Pins of port B that kilolib may pulse: its transmit mask.
constexpr std::array<int, 5> kInfraredPins{0, 1, 2, 6, 7};

std::uint8_t bit(std::uint8_t value, int i) { return static_cast<std::uint8_t>(value >> i & 1); }

/// mV that libsimavr converts to just so many counts.
std::uint32_t millivolts(std::int32_t counts, std::uint32_t reference_mV) {
  return (static_cast<std::uint32_t>(counts) * reference_mV + kCounts - 1) / kCounts;
}

}  // namespace

/// libsimavr has one logger for all processors of the process.
struct LogHook {
  static void log(avr_t* avr, int level, const char* format, va_list) {
    if (level > LOG_WARNING) return;  // libsimavr traces every conversion
    if (avr != nullptr && avr->custom.data != nullptr) Mcu::on_log(avr, level, format, nullptr);
  }
};

Mcu::Mcu(const FlashImage& image, const std::array<std::uint8_t, kEepromOctets>& eeprom, const Random& random,
         std::uint32_t robot, Core core)
    : random_(random), robot_(robot), program_(image.flash) {
  static std::once_flag once;
  std::call_once(once, [] { avr_global_logger_set(LogHook::log); });
  avr_ = avr_make_mcu_by_name("atmega328p");
  if (avr_ == nullptr) throw RunError("libsimavr lacks the ATmega328P");
  avr_->custom.data = nullptr;
  avr_init(avr_);
  avr_->custom.data = this;
  avr_->frequency = 8000000;
  avr_->vcc = avr_->avcc = avr_->aref = kReference_mV;

  // Memories in which no address of the processor lies outside.
  std::free(avr_->flash);
  avr_->flash = static_cast<std::uint8_t*>(std::malloc(kProgramSpace + 4));
  for (std::uint32_t at = 0; at < kProgramSpace; at += kFlashOctets)
    std::copy(program_.begin(), program_.end(), avr_->flash + at);
  std::fill_n(avr_->flash + kProgramSpace, 4, std::uint8_t{0xff});
  avr_->flashend = avr_->codeend = kProgramSpace - 1;
  auto* const data = static_cast<std::uint8_t*>(std::calloc(kDataSpace, 1));
  std::copy_n(avr_->data, avr_->ramend + 1u, data);
  std::free(avr_->data);
  avr_->data = data;
  avr_eeprom_desc_t description{const_cast<std::uint8_t*>(eeprom.data()), 0, kEepromOctets};
  avr_ioctl(avr_, AVR_IOCTL_EEPROM_SET, &description);

  for (avr_io_t* module = avr_->io_port; module != nullptr; module = module->next) {
    if (std::strcmp(module->kind, "watchdog") == 0) watchdog_ = module;
    if (std::strcmp(module->kind, "flash") == 0) write_flash_ = std::exchange(module->ioctl, on_flash);
    if (std::strcmp(module->kind, "timer") == 0 && reinterpret_cast<avr_timer_t*>(module)->name == '2') {
      // Mode 1, phase-correct PWM of 8 bits, which drives the motors, is not in libsimavr's table for timer 2.
      avr_timer_wgm_t& mode = reinterpret_cast<avr_timer_t*>(module)->wgm_op[1];
      mode.kind = avr_timer_wgm_fc_pwm;
      mode.size = 8;
    }
  }
  // Of the EEPROM's address the processor has ten bits, libsimavr sixteen.
  avr_register_io_write(
      avr_, kEearh,
      [](avr_t* avr, avr_io_addr_t address, std::uint8_t value, void*) { avr->data[address] = value & 3; },
      nullptr);
  // External interrupts by level are polled in every cycle while a pin is low; no Kilobot has a source for them.
  avr_extint_set_strict_lvl_trig(avr_, 0, 0);
  avr_extint_set_strict_lvl_trig(avr_, 1, 0);

  for (std::size_t i = 0; i < comparator_.size(); ++i)
    comparator_[i] = avr_io_getirq(avr_, AVR_IOCTL_ACOMP_GETIRQ, ACOMP_IRQ_AIN0 + static_cast<int>(i));
  converter_ = avr_io_getirq(avr_, AVR_IOCTL_ADC_GETIRQ, 0);
  if (core == Core::kFast) fast_converter_ = std::make_unique<Converter>(*avr_, [this] { start_conversion(); });
  for (const int pin : kInfraredPins)
    avr_irq_register_notify(avr_io_getirq(avr_, AVR_IOCTL_IOPORT_GETIRQ('B'), pin), on_led, this);
  avr_irq_register_notify(converter_ + ADC_IRQ_OUT_TRIGGER, on_conversion, this);
  std::uint32_t flags = 0;  // neither printed by libsimavr nor slowed down while polled
  avr_ioctl(avr_, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
  avr_irq_register_notify(avr_io_getirq(avr_, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), on_serial, this);
  for (const Register one : {kDdrB, kDdrD, kTccr2a, kOcr2a, kOcr2b})
    avr_irq_register_notify(avr_iomem_getirq(avr_, one, nullptr, AVR_IOMEM_IRQ_ALL), on_motor, this);
  if (core == Core::kFast) core_ = std::make_unique<FastCore>(*avr_, fast_converter_.get());
  after_reset();

  for (int i = 0; i < avr_->irq_pool.count; ++i) {
    if (avr_->irq_pool.irq[i] != nullptr) lines_.push_back(avr_->irq_pool.irq[i]);
  }
  flashes_.clear();
  mark();
  pristine_ = marked_;
}

Mcu::~Mcu() {
  avr_terminate(avr_);
  std::free(avr_);
}

/// Sets the pins to the levels that the board holds: it is dark.
void Mcu::after_reset() {
  hold_charger();
  avr_raise_irq(comparator_[1], kThreshold_mV);
  avr_raise_irq(comparator_[0], 0);
  state_.dark_at = kNever;
}

/// PD0 is low while the robot is charged.
void Mcu::hold_charger() {
  avr_irq_t* const pin = avr_io_getirq(avr_, AVR_IOCTL_IOPORT_GETIRQ('D'), 0);
  const std::uint32_t level = readings_.charging ? 0 : 1;
  if (pin->value != level) avr_raise_irq(pin, level);
}

void Mcu::set_readings(const senses::Readings& readings) {
  readings_ = readings;
  hold_charger();
}

void Mcu::power_off() {
  interrupt_core();
  avr_->state = cpu_Done;
  state_.halt = Halt::kFlat;
  state_.dark_at = kNever;
}

void Mcu::power_on() {
  State state;
  state.powered_down = now();
  state.conversions = state_.conversions;
  std::array<std::uint8_t, kEepromOctets> kept = eeprom();
  return_to_pristine();
  state_ = state;
  avr_eeprom_desc_t description{kept.data(), 0, kEepromOctets};
  avr_ioctl(avr_, AVR_IOCTL_EEPROM_SET, &description);
  after_reset();
  flashes_.clear();
  mark();
}

OwnCycles Mcu::now() const { return avr_->cycle + state_.powered_down; }

void Mcu::run(OwnCycles until, std::span<const Light> light) {
  const auto advance = [this](OwnCycles to) {
    while (state_.dark_at <= to) {
      execute(state_.dark_at);
      set_receiver(false);
      state_.dark_at = kNever;
    }
    execute(to);
  };
  for (const Light& pulse : light) {
    advance(pulse.at);
    avr_raise_irq(converter_ + ADC_IRQ_ADC0, millivolts(pulse.high_gain, kReference_mV));
    avr_raise_irq(converter_ + ADC_IRQ_ADC1, millivolts(pulse.low_gain, kReference_mV));
    const bool edge = state_.dark_at == kNever;
    set_receiver(true);
    state_.dark_at = pulse.at + kPulse;
    if (edge && (avr_->data[kAdcsra] & kAutoTrigger) != 0 &&
        (avr_->data[kAdcsrb] & kTriggerSource) == kByComparator) {
      avr_raise_irq(converter_ + ADC_IRQ_IN_TRIGGER, 1);
    }
  }
  advance(until);
}

void Mcu::set_receiver(bool lit) { avr_raise_irq(comparator_[0], lit ? kLit_mV : 0); }

void Mcu::execute(OwnCycles until) {
  while (now() < until) {
    if (avr_->state == cpu_Running) {
      run_burst(until - now());
    } else if (avr_->state == cpu_Sleeping && avr_->sreg[S_I] != 0) {
      if ((avr_->data[kSmcr] & kSleepMode) == kPowerDown)
        power_down(until);
      else
        doze(until);
    } else {
      if (state_.halt == Halt::kNone) state_.halt = Halt::kEnded;
      state_.powered_down += until - now();
    }
  }
}

/// Instructions until something else is due. libsimavr stops by itself where an instruction schedules something, as its
/// run_cycle_limit stays 1.
void Mcu::run_burst(OwnCycles budget) {
  if (avr_->run != avr_callback_run_raw) {  // the watchdog resets it
    interrupt_core();
    avr_->run(avr_);
    return after_reset();
  }
  const avr_cycle_timer_slot_t* const next = avr_->cycle_timers.timer;
  avr_cycle_count_t cycles = budget;
  if (next != nullptr) cycles = next->when > avr_->cycle ? std::min(cycles, next->when - avr_->cycle) : 1;
  avr_flashaddr_t at = avr_->pc;
  if (core_ && avr_->interrupt_state == 0) {
    const FastCore::Run run = core_->run(*avr_, cycles);
    cycles = run.passed < run.due ? 1 : 0;  // then one instruction of libsimavr
    at = avr_->pc;
  }
  avr_->run_cycle_count = cycles;
  if (cycles > 0) {
    interrupt_core();
    at = avr_run_one(avr_);
  }
  if (avr_->state == cpu_Crashed) {
    if (state_.halt == Halt::kNone) {  // it ran out of the flash
      state_.halt = Halt::kBadAddress;
      state_.fault_at = avr_->pc;
    }
    return;
  }
  if (fast_converter_) fast_converter_->end_due(*avr_);
  avr_cycle_timer_process(avr_);
  avr_->pc = at % kFlashOctets;
  serve_interrupts();
}

/// Registers and RAM are about to change by something else than the core.
void Mcu::interrupt_core() {
  if (core_) core_->interrupt(*avr_);
}

/// Brings registers and RAM up to date.
void Mcu::settle() const {
  if (core_) core_->settle(*avr_);
}

void Mcu::serve_interrupts() {
  if (avr_->interrupt_state == 0) return;
  interrupt_core();
  const avr_flashaddr_t before = avr_->pc;
  avr_service_interrupts(avr_);
  if (avr_->pc != before && (avr_->data[kMcucr] & kIvsel) != 0) avr_->pc += kBootSection;
}

/// Asleep with its clocks on: on to what is due next.
void Mcu::doze(OwnCycles until) {
  const avr_cycle_timer_slot_t* const next = avr_->cycle_timers.timer;
  const OwnCycles left = until - now();
  const OwnCycles due = next == nullptr ? left : next->when > avr_->cycle ? next->when - avr_->cycle : 0;
  avr_->cycle += std::min(due, left);
  avr_cycle_timer_process(avr_);
  serve_interrupts();
}

/// Asleep with its clocks off: only the watchdog, which has a clock of its own, goes on.
void Mcu::power_down(OwnCycles until) {
  avr_cycle_timer_slot_t* slot = avr_->cycle_timers.timer;
  while (slot != nullptr && slot->param != watchdog_) slot = slot->next;
  const OwnCycles left = until - now();
  if (slot == nullptr) {
    state_.powered_down += left;
    return;
  }
  const OwnCycles due = slot->when > avr_->cycle ? slot->when - avr_->cycle : 0;
  const OwnCycles passed = std::min(due, left);
  state_.powered_down += passed;
  avr_cycle_timer_register(avr_, due - passed, slot->timer, slot->param);
  if (passed < due) return;
  avr_cycle_timer_process(avr_);
  serve_interrupts();
}

Outputs Mcu::outputs() const {
  const std::uint8_t* const data = avr_->data;
  Outputs out;
  if (state_.halt != Halt::kNone && state_.halt != Halt::kEnded) return out;
  const auto duty = [&](int driven, int high, int mode, std::uint16_t value) -> std::uint8_t {
    if (driven == 0) return 0;
    if (mode != 0) return data[value];
    return high != 0 ? 255 : 0;
  };
  out.motor_left = duty(bit(data[kDdrB], 3), bit(data[kPortB], 3), data[kTccr2a] & 0xc0, kOcr2a);
  out.motor_right = duty(bit(data[kDdrD], 3), bit(data[kPortD], 3), data[kTccr2a] & 0x30, kOcr2b);
  // A colour is on where its pin is an output and low.
  const std::uint8_t c = data[kDdrC] & static_cast<std::uint8_t>(~data[kPortC]);
  const std::uint8_t d = data[kDdrD] & static_cast<std::uint8_t>(~data[kPortD]);
  out.led = static_cast<std::uint8_t>(bit(d, 5) | bit(d, 4) << 1 | bit(c, 3) << 2 | bit(c, 2) << 3 |
                                      bit(c, 5) << 4 | bit(c, 4) << 5);
  return out;
}

bool Mcu::listening() const {
  if (state_.halt != Halt::kNone) return false;
  return avr_->state != cpu_Sleeping || (avr_->data[kSmcr] & kSleepMode) != kPowerDown;
}

std::uint32_t Mcu::program_counter() const {
  if (state_.fault_at != 0) return state_.fault_at % kFlashOctets;
  settle();
  return avr_->pc;
}

std::uint8_t Mcu::memory(std::uint16_t address) const {
  settle();
  return avr_->data[address];
}

std::array<std::uint8_t, kEepromOctets> Mcu::eeprom() const {
  std::array<std::uint8_t, kEepromOctets> octets{};
  avr_eeprom_desc_t description{octets.data(), 0, kEepromOctets};
  avr_ioctl(avr_, AVR_IOCTL_EEPROM_GET, &description);
  return octets;
}

std::span<const std::uint8_t, kFlashOctets> Mcu::flash() const {
  return std::span<const std::uint8_t, kFlashOctets>(avr_->flash, kFlashOctets);
}

/// The flash repeats in program space.
void Mcu::put_page(std::uint32_t address, const std::uint8_t* octets) {
  for (std::uint32_t at = address; at < kProgramSpace; at += kFlashOctets)
    std::memmove(avr_->flash + at, octets, kPageOctets);
  if (core_) core_->forget(address, kPageOctets);
}

void Mcu::keep_page(std::uint32_t address) {
  const auto is_there = [address](const Page& page) { return page.address == address; };
  if (std::any_of(replaced_.begin(), replaced_.end(), is_there)) return;
  Page& page = replaced_.emplace_back();
  page.address = address;
  std::copy_n(avr_->flash + address, kPageOctets, page.octets.begin());
}

/// The instruction SPM. libsimavr erases and writes at once, and in one of the flash's repetitions.
int Mcu::on_flash(avr_io_t* module, std::uint32_t request, void* parameter) {
  avr_t* const avr = module->avr;
  auto& self = *static_cast<Mcu*>(avr->custom.data);
  const std::uint8_t control = avr->data[kSpmcsr];
  const bool changes = request == AVR_IOCTL_FLASH_SPM && (control & kSelfProgramming) != 0 &&
                       (control & (kPageErase | kPageWrite)) != 0;
  if (!changes) return self.write_flash_(module, request, parameter);
  const std::uint32_t place =
      (avr->data[kPointerZ] | std::uint32_t{avr->data[kPointerZ + 1]} << 8) / kPageOctets * kPageOctets;
  self.keep_page(place % kFlashOctets);
  const int result = self.write_flash_(module, request, parameter);
  self.put_page(place % kFlashOctets, avr->flash + place);
  avr->data[kSpmcsr] |= kSelfProgramming;
  avr_cycle_timer_register(
      avr, kPageTime,
      [](avr_t* done, avr_cycle_count_t, void*) -> avr_cycle_count_t {
        done->data[kSpmcsr] &= static_cast<std::uint8_t>(~kSelfProgramming);
        return 0;
      },
      module);
  return result;
}

/// A register that drives the motors has been written.
void Mcu::on_motor(avr_irq_t*, std::uint32_t, void* mcu) { static_cast<Mcu*>(mcu)->note_motors(); }

void Mcu::note_motors() {
  constexpr OwnCycles kBothWritten = 64;
  const Outputs out = outputs();
  State& s = state_;
  if (out.motor_left == s.left && out.motor_right == s.right) return;
  const OwnCycles at = now();
  if (at - s.changed_at > kBothWritten) {
    s.steady_left = s.left;
    s.steady_right = s.right;
    add_phase();
  }
  s.changed_at = at;
  s.left = out.motor_left;
  s.right = out.motor_right;
  const bool full = s.left == 255 && s.right == 255;
  if (full && s.full_since == kNever) {
    s.full_since = at;
    s.before_left = s.steady_left;
    s.before_right = s.steady_right;
  } else if (!full && s.full_since != kNever) {
    s.full_cycles += at - std::max(s.full_since, s.motors_from);
    s.full_since = kNever;
  }
}

/// Counts the duties since their last change, or since the last call of take_motors().
void Mcu::add_phase() {
  State& s = state_;
  kilotwin_add_motors(&s.phases, s.left, s.right,
                      static_cast<std::uint32_t>(now() - std::max(s.changed_at, s.motors_from)));
}

Mcu::MotorUse Mcu::take_motors() {
  note_motors();
  State& s = state_;
  if (s.phases.count != 0) add_phase();
  MotorUse use{s.full_cycles, s.left, s.right, s.phases};
  s.phases = {};
  if (s.full_since != kNever) {
    use.full_cycles += now() - std::max(s.full_since, s.motors_from);
    if (s.full_since > s.motors_from) {
      use.left = s.before_left;
      use.right = s.before_right;
    } else {
      use.full_cycles = 0;
    }
  }
  s.full_cycles = 0;
  s.motors_from = now();
  return use;
}

void Mcu::on_led(avr_irq_t* pin, std::uint32_t value, void* mcu) {
  auto& self = *static_cast<Mcu*>(mcu);
  if ((value & 1) == 0 || (pin->value & 1) != 0) return;
  if (self.flashes_.empty() || self.flashes_.back() != self.now()) self.flashes_.push_back(self.now());
}

/// A conversion begins: the sensors take their readings.
void Mcu::on_conversion(avr_irq_t*, std::uint32_t, void* mcu) { static_cast<Mcu*>(mcu)->start_conversion(); }

void Mcu::start_conversion() {
  const std::uint8_t mux = avr_->data[kAdmux];
  int line = 0;
  double reading = 0, sd = 0;
  switch (mux & kChannel) {
    case 6: line = ADC_IRQ_ADC6, reading = readings_.voltage, sd = readings_.voltage_sd; break;
    case 7: line = ADC_IRQ_ADC7, reading = readings_.light, sd = readings_.light_sd; break;
    case 8: line = ADC_IRQ_TEMP, reading = readings_.temperature, sd = readings_.temperature_sd; break;
    default: return;
  }
  const std::uint32_t n = state_.conversions++;
  const double noise = sd > 0 ? sd * random_.normal(Stream::kConverter, robot_, Tick{n >> 16}, n & 0xffff) : 0;
  const auto counts = static_cast<std::int32_t>(std::clamp(reading + noise + 0.5, 0.0, double{kCounts}));
  const bool internal = (mux & kReference) == kReference;
  const std::uint32_t voltage_mV = millivolts(counts, internal ? kInternalReference_mV : kReference_mV);
  if (fast_converter_)
    fast_converter_->set_voltage(line, voltage_mV);
  else
    avr_raise_irq(converter_ + line, voltage_mV);
}

void Mcu::on_serial(avr_irq_t*, std::uint32_t octet, void* mcu) {
  static_cast<Mcu*>(mcu)->printed_.push_back(static_cast<char>(octet));
}

void Mcu::on_log(avr_t* avr, int, const char* format, void*) {
  auto& self = *static_cast<Mcu*>(avr->custom.data);
  const bool illegal = std::strstr(format, "Invalid Opcode") != nullptr;
  if (self.state_.halt != Halt::kNone || (!illegal && std::strstr(format, "CORE: *** Invalid") == nullptr)) return;
  self.state_.halt = illegal ? Halt::kIllegalInstruction : Halt::kBadAddress;
  self.state_.fault_at = avr->pc;
  avr->state = cpu_Crashed;
  // ELPM, which this processor lacks: libsimavr says so, and then reads the flash all the same, at an address whose upper octet
  // it takes from R0.
  avr->data[0] = 0;
}

}  // namespace kilotwin::firmware
