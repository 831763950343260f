/// Runs one robot's code in a slot: memory in, interrupts, main program, memory out.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <string>

#include "services/behaviours/faults.hpp"
#include "services/behaviours/image.hpp"

namespace kilotwin::behaviours {

/// Octets below a stack pointer, the end of what frames were there, that are zero whenever a robot begins to run: one that looks
/// there by mistake finds the same whoever ran before it.
inline constexpr std::uint32_t kClearedOctets = 256;
/// Sets octets to zero, by the library's function: where compilers see how many octets there are, they choose an instruction
/// that takes longer to begin than this does.
inline void clear(std::uint8_t* first, std::size_t octets) {
  __asm__("" : "+r"(octets));
  std::memset(first, 0, octets);
}

/// A robot's memory while it does not run: its data with what it uses of its heap, then its live stack, in one buffer.
class RobotMemory {
 public:
  /// As at reset: initial data, and a stack from which the main program starts.
  void reset(const Program&, const Slot&);
  /// From a checkpoint. Throws RunError where the sizes do not fit the program.
  void restore(const Program&, const Slot&, std::span<const std::uint8_t> data,
               std::span<const std::uint8_t> stack);
  void release() { *this = RobotMemory(); }

  void prefetch() const {
    for (std::uint32_t at = 0; at < data_octets_ + stack_octets_; at += 64) __builtin_prefetch(octets_.get() + at);
  }
  void copy_in(const Slot& slot, RobotThread& thread) const {
    std::memcpy(slot.data(), octets_.get(), data_octets_);
    clear(slot.data() + data_octets_, kSlackOctets);
    auto* const stack = reinterpret_cast<std::uint8_t*>(slot.stack_top() - stack_octets_);  // NOLINT
    std::memcpy(stack, octets_.get() + data_octets_, stack_octets_);
    if (stack_octets_ + kClearedOctets <= kStackOctets) clear(stack - kClearedOctets, kClearedOctets);
    thread.robot_stack = slot.stack_top() - stack_octets_;
  }
  /// `data_octets`: Executor::data_octets(). False where the robot's stack pointer has left its stack.
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

  [[nodiscard]] std::span<std::uint8_t> data() { return {octets_.get(), data_octets_}; }
  [[nodiscard]] std::span<const std::uint8_t> data() const { return {octets_.get(), data_octets_}; }
  [[nodiscard]] std::span<const std::uint8_t> stack() const {
    return {octets_.get() + data_octets_, stack_octets_};
  }

  /// A variable of the robot: `offset` is one of ElfFile::table.
  template <class T> [[nodiscard]] T get(const Program& program, std::uint64_t offset) const {
    T value;
    std::memcpy(&value, octets_.get() + (offset - program.file.data.first), sizeof value);
    return value;
  }
  template <class T> void set(const Program& program, std::uint64_t offset, const T& value) {
    std::memcpy(octets_.get() + (offset - program.file.data.first), &value, sizeof value);
  }

 private:
  void resize(std::uint32_t data_octets, std::uint32_t stack_octets);

  std::unique_ptr<std::uint8_t[]> octets_;
  std::uint32_t capacity_ = 0, data_octets_ = 0, stack_octets_ = 0;
};

/// Code of the robot whose memory is in the slot. Each call returns what faulted, until the next call, or null. Needs the
/// slot's mutex and a FaultGuard on this thread.
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
  /// Of the memory of the robot in the slot, heap included. The robot may have written anything there.
  [[nodiscard]] std::uint32_t data_octets() const {
    return fixed_octets_ + std::min(robot_->heap_octets, heap_octets_);
  }
  /// Of its own clock, by so many ticks.
  void advance_clock(std::uint32_t ticks) const {
    std::uint32_t value = 0;
    std::memcpy(&value, ticks_, sizeof value);
    value += ticks;
    std::memcpy(ticks_, &value, sizeof value);
  }
  [[nodiscard]] std::uint16_t tx_period() const {
    std::uint16_t value = 0;
    std::memcpy(&value, tx_period_, sizeof value);
    return value;
  }

  /// Notes what the host has found to be a fault.
  [[nodiscard]] const Fault* fail(const Fault& fault) const {
    thread_.fault = fault;
    return &thread_.fault;
  }

  struct Main {
    const Fault* fault = nullptr;
    bool preempted = false;  ///< it was stopped within its code, having used up its cycles
    std::int32_t spins = 0;  ///< not 0: ... in a loop that only an interrupt can end
    std::int32_t left = 0;   ///< cycles; negative: it has used more
  };
  /// The main program, until it waits or has used up so many cycles. `spun`: what Main::spins was the last time, or 0; a hint
  /// that changes how long this takes and nothing else.
  [[nodiscard]] Main run_main(std::int32_t cycles, std::int32_t spun) const {
    Main main;
    main.left = cycles;
    if (robot_->looped == 0 && spun == 0 && !run(main, std::min(cycles, kUnsuspected))) return main;
    follow(main, spun);
    return main;
  }

  /// Callbacks for what has happened. `cycles` is what they have used.
  [[nodiscard]] const Fault* interrupt(std::span<const KtReception> receptions, bool sent,
                                       std::int32_t& cycles) const;
  /// `message` is what the robot gives, or null.
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
  /// After so many cycles a program is suspected of waiting in a loop.
  static constexpr std::int32_t kUnsuspected = 32768;

  /// The main program to the next test of its cycles, or as far as `slice` of them goes; false when that ended otherwise than
  /// by preemption.
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
  void follow(Main& main, std::int32_t spun) const;
  [[nodiscard]] const Fault* call(std::uint64_t function, std::uint64_t& result, std::int32_t& cycles) const;
  [[nodiscard]] const Fault* fault() const {
    return thread_.fault.signal == Fault::kNone ? nullptr : &thread_.fault;
  }

  const Slot& slot_;
  const std::uint32_t fixed_octets_, heap_octets_;  ///< of data; of the heap at most
  RobotThread& thread_;
  std::uint64_t leave_;
  Enter* enter_;
  Call* call_;
  std::uint64_t interrupts_, transmit_;
  KtRobot* robot_;
  std::uint32_t* ticks_;
  const std::uint16_t* tx_period_;
};

/// A fault in words: what, where in the program.
[[nodiscard]] std::string describe(const Fault&, const Program&, const Slot&);
/// A division by zero at this address, in words.
[[nodiscard]] std::string describe_division(std::uint64_t code, const Program&, const Slot&);

}  // namespace kilotwin::behaviours
