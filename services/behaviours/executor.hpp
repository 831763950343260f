/// Runs one robot's code in a slot: copies its memory in, runs callbacks and main program, copies its memory out.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <string>

#include "services/behaviours/faults.hpp"
#include "services/behaviours/image.hpp"

namespace kilotwin::behaviours {

/// Octets below the stack pointer that are cleared before a robot runs. A program that reads there by mistake gets the same result
/// whichever robot used the slot before.
inline constexpr std::uint32_t kClearedOctets = 256;
/// Clears octets at an address. Written out: a call takes longer, and so does the `rep stos` of compilers.
template <std::uint32_t kOctets> void clear(std::uint64_t address) {
  using Words = std::uint64_t __attribute__((vector_size(16), aligned(1), may_alias));
  auto* const words = reinterpret_cast<Words*>(address);  // NOLINT
#pragma GCC unroll 16
  for (std::uint32_t n = 0; n < kOctets / sizeof(Words); ++n) words[n] = Words{};
}

/// A robot's memory while it does not run, in one buffer: its data, the used part of its heap, its live stack.
class RobotMemory {
 public:
  /// The state at reset: initial data, and a stack frame from which the main program starts.
  void reset(const Program&, const Slot&);
  /// Loads the memory from a checkpoint. Throws RunError if the sizes do not fit the program.
  void restore(const Program&, const Slot&, std::span<const std::uint8_t> data,
               std::span<const std::uint8_t> stack);
  void release() { *this = RobotMemory(); }

  void prefetch() const {
    const std::uint8_t* const first = octets_.get();
    for (const std::uint8_t* line = first + data_octets_ + stack_octets_; line > first; line -= 64)
      __builtin_prefetch(line - 1);
  }
  void copy_in(const Slot& slot, RobotThread& thread) const {
    std::memcpy(slot.data(), octets_.get(), data_octets_);
    clear<kSlackOctets>(reinterpret_cast<std::uint64_t>(slot.data()) + data_octets_);  // NOLINT
    thread.robot_stack = slot.stack_top() - stack_octets_;
    auto* const stack = reinterpret_cast<std::uint8_t*>(thread.robot_stack);  // NOLINT
    std::memcpy(stack, octets_.get() + data_octets_, stack_octets_);
    if (stack_octets_ + kClearedOctets <= kStackOctets) clear<kClearedOctets>(thread.robot_stack - kClearedOctets);
  }
  /// `data_octets`: Executor::data_octets(). False if the robot's stack pointer lies outside its stack.
  [[nodiscard]] bool copy_out(const Slot& slot, std::uint32_t data_octets, const RobotThread& thread) {
    const std::uint64_t size = slot.stack_top() - thread.robot_stack;
    if (size > kStackOctets) return false;
    if (data_octets + size > capacity_) resize(data_octets, static_cast<std::uint32_t>(size));
    data_octets_ = data_octets;
    stack_octets_ = static_cast<std::uint32_t>(size);
    std::memcpy(octets_.get(), slot.data(), data_octets_);
    const auto* const stack = reinterpret_cast<const std::uint8_t*>(thread.robot_stack);  // NOLINT
    std::memcpy(octets_.get() + data_octets_, stack, size);
    return true;
  }

  /// Whether the robot in the slot has this memory, besides its clocks and what the host counts. These are copied out.
  [[nodiscard]] bool settles(const Program& program, const Slot& slot, std::uint32_t data_octets,
                             const RobotThread& thread) {
    if (data_octets != data_octets_ || slot.stack_top() - thread.robot_stack != stack_octets_) return false;
    const std::size_t clocks = program.file.table.robot - program.file.data.first + kClocks;
    std::memcpy(octets_.get() + clocks, slot.data() + clocks, sizeof(KtRobot) - kClocks);
    const auto* const stack = reinterpret_cast<const std::uint8_t*>(thread.robot_stack);  // NOLINT
    return std::memcmp(slot.data(), octets_.get(), data_octets_) == 0 &&
           std::memcmp(stack, octets_.get() + data_octets_, stack_octets_) == 0;
  }

  [[nodiscard]] std::span<std::uint8_t> data() { return {octets_.get(), data_octets_}; }
  [[nodiscard]] std::span<const std::uint8_t> data() const { return {octets_.get(), data_octets_}; }
  [[nodiscard]] std::span<const std::uint8_t> stack() const {
    return {octets_.get() + data_octets_, stack_octets_};
  }

  /// Reads a variable of the robot at an offset from ElfFile::table.
  template <class T> [[nodiscard]] T get(const Program& program, std::uint64_t offset) const {
    T value;
    std::memcpy(&value, octets_.get() + (offset - program.file.data.first), sizeof value);
    return value;
  }
  template <class T> void set(const Program& program, std::uint64_t offset, const T& value) {
    std::memcpy(octets_.get() + (offset - program.file.data.first), &value, sizeof value);
  }

 private:
  /// From here to its end KtRobot holds clocks.
  static constexpr std::size_t kClocks = offsetof(KtRobot, debt_cycles);

  void resize(std::uint32_t data_octets, std::uint32_t stack_octets);

  std::unique_ptr<std::uint8_t[]> octets_;
  std::uint32_t capacity_ = 0, data_octets_ = 0, stack_octets_ = 0;
};

/// Runs code of the robot whose memory is in the slot. Each call returns its fault, valid until the next call, or null. Requires
/// the slot's mutex and a FaultGuard on this thread.
class Executor {
 public:
  Executor(const Program& program, const Slot& slot, RobotThread& thread)
      : slot_(slot),
        fixed_octets_(static_cast<std::uint32_t>(program.data_size())),
        heap_octets_(static_cast<std::uint32_t>(program.file.heap.last - program.file.heap.first)),
        thread_(thread),
        leave_(slot.image_address() + program.file.table.leave),
        enter_(slot.at<Enter*>(program.file.table.enter)),
        call_(slot.at<Call*>(program.file.table.call)),
        interrupts_(slot.image_address() + program.file.table.interrupts),
        transmit_(slot.image_address() + program.file.table.transmit),
        robot_(slot.at<KtRobot*>(program.file.table.robot)),
        ticks_(slot.at<std::uint32_t*>(program.file.table.ticks)),
        tx_period_(slot.at<std::uint16_t*>(program.file.table.tx_period)) {
    thread_.interrupt_stack = slot.interrupt_stack_top();
  }

  /// The simulated hardware of the robot in the slot.
  [[nodiscard]] KtRobot& robot() const { return *robot_; }
  [[nodiscard]] RobotThread& thread() const { return thread_; }
  /// Size of data and used heap of the robot in the slot. Limited, because the robot may have overwritten heap_octets.
  [[nodiscard]] std::uint32_t data_octets() const {
    return fixed_octets_ + std::min(robot_->heap_octets, heap_octets_);
  }
  /// Advances kilo_ticks.
  void advance_clock(std::uint32_t ticks) const {
    std::uint32_t value = 0;
    std::memcpy(&value, ticks_, sizeof value);
    value += ticks;
    std::memcpy(ticks_, &value, sizeof value);
  }
  [[nodiscard]] std::uint32_t ticks() const {
    std::uint32_t value = 0;
    std::memcpy(&value, ticks_, sizeof value);
    return value;
  }
  [[nodiscard]] std::uint16_t tx_period() const {
    std::uint16_t value = 0;
    std::memcpy(&value, tx_period_, sizeof value);
    return value;
  }

  /// Reports a fault that the host has detected.
  [[nodiscard]] const Fault* fail(const Fault& fault) const {
    thread_.fault = fault;
    return &thread_.fault;
  }

  struct Main {
    const Fault* fault = nullptr;
    bool preempted = false;  ///< it used up its budget and was stopped within its code
    /// Cycles per round of a busy wait, a loop that only an interrupt can end; 0: it is in no such loop.
    std::int32_t wait_period = 0;
    std::int32_t left = 0;  ///< cycles left of the budget; negative: exceeded
  };
  /// Runs the main program until it waits or has used up `cycles`. `previous_period` is Main::wait_period of the last tick, or 0; it
  /// is a hint that affects the computing time and not the result.
  [[nodiscard]] Main run_main(std::int32_t cycles, std::int32_t previous_period) const {
    Main main;
    main.left = cycles;
    if (robot_->looped == 0 && previous_period == 0 && !run(main, std::min(cycles, kUnsuspected))) return main;
    run_busy_wait(main, previous_period);
    return main;
  }

  /// Calls kilo_message_tx_success if `sent`, and kilo_message_rx per reception. Adds their cycles to `cycles`.
  [[nodiscard]] const Fault* interrupt(std::span<const KtReception> receptions, bool sent,
                                       std::int32_t& cycles) const {
    KtExchange& exchange = *slot_.exchange();
    exchange.sent = sent ? 1 : 0;
    do {
      const auto part = receptions.first(std::min<std::size_t>(receptions.size(), KT_MOST_RECEPTIONS));
      exchange.receptions = static_cast<std::uint32_t>(part.size());
      std::copy(part.begin(), part.end(), exchange.reception);
      std::uint64_t result = 0;
      if (const Fault* const fault = call(interrupts_, result, cycles)) return fault;
      receptions = receptions.subspan(part.size());
      exchange.sent = 0;
    } while (!receptions.empty() && robot_->reset == 0);
    return nullptr;
  }
  /// Calls kilo_message_tx. `message` becomes the robot's message, or null if it has none. Adds the cycles to `cycles`.
  [[nodiscard]] const Fault* transmit(const KtMessage*& message, std::int32_t& cycles) const;

 private:
  using Enter = std::uint64_t();
  using Call = std::uint64_t(std::uint64_t function);

  void begin() const {
    thread_.fault.signal = Fault::kNone;
    std::atomic_signal_fence(std::memory_order_seq_cst);
    thread_.leave = leave_;
    std::atomic_signal_fence(std::memory_order_seq_cst);
  }
  void end() const {
    std::atomic_signal_fence(std::memory_order_seq_cst);
    thread_.leave = 0;
    std::atomic_signal_fence(std::memory_order_seq_cst);
  }
  /// Limit of a callback: one second of the robot's time. On a robot a longer callback would block all messages, the clock and the
  /// main program.
  static constexpr std::int32_t kCallbackCycles = 8'000'000;
  /// A program that runs for this many cycles is checked for a busy wait.
  static constexpr std::int32_t kUnsuspected = 32768;

  /// Runs the main program for `slice` cycles, at least to the next test of its budget. False if it ended in another way than by
  /// preemption.
  bool run(Main& main, std::int32_t slice) const {
    thread_.held = main.left - slice;
    thread_.budget = slice;
    begin();
    main.preempted = enter_() == KT_PREEMPTED;
    end();
    main.left -= slice - thread_.budget;
    main.fault = fault();
    main.preempted = main.preempted && main.fault == nullptr;
    return main.preempted;
  }
  void run_busy_wait(Main& main, std::int32_t previous_period) const;
  [[nodiscard]] const Fault* call(std::uint64_t function, std::uint64_t& result, std::int32_t& cycles) const {
    thread_.budget = kCallbackCycles;
    thread_.overrun = 0;
    clear<kClearedOctets>(slot_.interrupt_stack_top() - kClearedOctets);
    begin();
    result = call_(function);
    end();
    cycles += kCallbackCycles - thread_.budget;
    if (thread_.overrun != 0) return fail({Fault::kCallbackOverrun, robot_->in_interrupt, thread_.place});
    return fault();
  }
  [[nodiscard]] const Fault* fault() const {
    return thread_.fault.signal == Fault::kNone ? nullptr : &thread_.fault;
  }

  const Slot& slot_;
  const std::uint32_t fixed_octets_, heap_octets_;  ///< size of the data; largest size of the heap
  RobotThread& thread_;
  std::uint64_t leave_;
  Enter* enter_;
  Call* call_;
  std::uint64_t interrupts_, transmit_;
  KtRobot* robot_;
  std::uint32_t* ticks_;
  const std::uint16_t* tx_period_;
};

/// One line about a fault: what happened and where in the program.
[[nodiscard]] std::string describe(const Fault&, const Program&, const Slot&);
/// One line about an int that does not hold a value; `code`: the address after the call that told it.
[[nodiscard]] std::string describe_overflow(std::uint64_t code, const Program&, const Slot&);
/// One line about a request of memory that the heap cannot fulfil; `code`: the address after the call that made it.
[[nodiscard]] std::string describe_full_heap(std::uint64_t code, const Program&, const Slot&);
/// One line about a division by zero at address `code`.
[[nodiscard]] std::string describe_division(std::uint64_t code, const Program&, const Slot&);

}  // namespace kilotwin::behaviours
