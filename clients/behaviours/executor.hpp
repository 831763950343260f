/// Runs one robot's code in a slot: memory in, interrupts, main program, memory out.
#pragma once

#include <atomic>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <string>

#include "clients/behaviours/faults.hpp"
#include "clients/behaviours/image.hpp"

namespace kilotwin::behaviours {

/// A robot's memory while it does not run: its data, then its live stack, in one buffer.
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
    std::memset(slot.data() + data_octets_, 0, kSlackOctets);
    auto* const stack = reinterpret_cast<std::uint8_t*>(slot.stack_top() - stack_octets_);  // NOLINT
    std::memcpy(stack, octets_.get() + data_octets_, stack_octets_);
    thread.robot_stack = slot.stack_top() - stack_octets_;
  }
  /// False where the robot's stack pointer has left its stack.
  [[nodiscard]] bool copy_out(const Slot& slot, const RobotThread& thread) {
    const std::uint64_t size = slot.stack_top() - thread.robot_stack;
    if (size > kStackOctets) return false;
    if (data_octets_ + size > capacity_) resize(data_octets_, static_cast<std::uint32_t>(size));
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

/// Code of the robot whose memory is in the slot. Each call returns what faulted, if anything. Needs the slot's mutex and a
/// FaultGuard on this thread.
class Executor {
 public:
  Executor(const Program& program, const Slot& slot, RobotThread& thread)
      : slot_(slot),
        data_octets_(program.data_size()),
        thread_(thread),
        leave_(slot.image_address() + program.file.table.leave),
        enter_(slot.at<Enter*>(program.file.table.enter)),
        call_(slot.at<Call*>(program.file.table.call)),
        interrupts_(slot.image_address() + program.file.table.interrupts),
        transmit_(slot.image_address() + program.file.table.transmit),
        robot_(slot.at<KtRobot*>(program.file.table.robot)),
        tx_period_(slot.at<std::uint16_t*>(program.file.table.tx_period)) {
    thread_.interrupt_stack = slot.interrupt_stack_top();
  }

  /// The simulated hardware of the robot in the slot.
  [[nodiscard]] KtRobot& robot() const { return *robot_; }
  [[nodiscard]] RobotThread& thread() const { return thread_; }
  [[nodiscard]] std::uint16_t tx_period() const {
    std::uint16_t value = 0;
    std::memcpy(&value, tx_period_, sizeof value);
    return value;
  }

  struct Main {
    Fault fault;
    bool preempted = false;  ///< it was stopped within its code, having used up its cycles
    bool spins = false;      ///< ... in a loop that only an interrupt can end
    std::int32_t left = 0;   ///< cycles; negative: it has used more
  };
  /// The main program, until it waits or has used up so many cycles. `spun`: how that ended the last time; a hint that
  /// changes how long this takes and nothing else.
  [[nodiscard]] Main run_main(std::int32_t cycles, bool spun) const;

  /// Callbacks for what has happened. `cycles` is what they have used.
  [[nodiscard]] Fault interrupt(std::span<const KtReception> receptions, bool sent, std::int32_t& cycles) const;
  /// `message` is what the robot gives, or null.
  [[nodiscard]] Fault transmit(const KtMessage*& message, std::int32_t& cycles) const;

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
  [[nodiscard]] bool enter(std::int32_t cycles) const;  ///< whether the robot was preempted
  [[nodiscard]] Fault call(std::uint64_t function, std::uint64_t& result, std::int32_t& cycles) const;

  const Slot& slot_;
  const std::size_t data_octets_;
  RobotThread& thread_;
  std::uint64_t leave_;
  Enter* enter_;
  Call* call_;
  std::uint64_t interrupts_, transmit_;
  KtRobot* robot_;
  const std::uint16_t* tx_period_;
};

/// A fault in words: what, where in the program.
[[nodiscard]] std::string describe(const Fault&, const Program&, const Slot&);
/// A division by zero at this address, in words.
[[nodiscard]] std::string describe_division(std::uint64_t code, const Program&, const Slot&);

}  // namespace kilotwin::behaviours
