/// Runs one robot's code in a slot: memory in, interrupts, main program, memory out.
#pragma once

#include <cstdint>
#include <cstring>
#include <memory>
#include <span>

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

  void copy_in(const Slot& slot) const {
    std::memcpy(slot.data(), octets_.get(), data_octets_);
    auto* const stack = reinterpret_cast<std::uint8_t*>(slot.stack_top() - stack_octets_);  // NOLINT
    std::memcpy(stack, octets_.get() + data_octets_, stack_octets_);
    slot.control()->robot_stack = slot.stack_top() - stack_octets_;
  }
  /// False where the robot's stack pointer has left its stack.
  [[nodiscard]] bool copy_out(const Slot& slot) {
    const std::uint64_t size = slot.stack_top() - slot.control()->robot_stack;
    if (size > kStackOctets) return false;
    if (data_octets_ + size > capacity_) resize(data_octets_, static_cast<std::uint32_t>(size));
    stack_octets_ = static_cast<std::uint32_t>(size);
    std::memcpy(octets_.get(), slot.data(), data_octets_);
    const auto* const stack = reinterpret_cast<const std::uint8_t*>(slot.control()->robot_stack);  // NOLINT
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

/// Code of the robot whose memory is in the slot. Each returns what faulted, if anything. Needs the slot's mutex and a
/// FaultGuard on this thread.
class Executor {
 public:
  Executor(const Program& program, const Slot& slot)
      : slot_(slot),
        leave_(slot.image_address() + program.file.table.leave),
        enter_(slot.at<Enter*>(program.file.table.enter)),
        call_(slot.at<Call*>(program.file.table.call)),
        interrupts_(slot.image_address() + program.file.table.interrupts),
        transmit_(slot.image_address() + program.file.table.transmit),
        robot_(slot.at<KtRobot*>(program.file.table.robot)),
        tx_period_(slot.at<std::uint16_t*>(program.file.table.tx_period)) {}

  /// The simulated hardware of the robot in the slot.
  [[nodiscard]] KtRobot robot() const {
    KtRobot robot;
    std::memcpy(&robot, robot_, sizeof robot);
    return robot;
  }
  [[nodiscard]] std::uint16_t tx_period() const {
    std::uint16_t value = 0;
    std::memcpy(&value, tx_period_, sizeof value);
    return value;
  }

  [[nodiscard]] Fault run_main() const {
    FaultGuard::begin(leave_);
    enter_(slot_.control());
    return FaultGuard::end();
  }
  [[nodiscard]] Fault interrupt(const KtEvents& events) const {
    FaultGuard::begin(leave_);
    (void)call_(slot_.control(), interrupts_, &events);
    return FaultGuard::end();
  }
  /// `sends` tells whether the robot has given a message.
  [[nodiscard]] Fault transmit(KtMessage& message, bool& sends) const {
    FaultGuard::begin(leave_);
    sends = call_(slot_.control(), transmit_, &message) == 1;
    return FaultGuard::end();
  }

 private:
  using Enter = void(KtControl*);
  using Call = std::uint64_t(KtControl*, std::uint64_t function, const void* argument);

  const Slot& slot_;
  std::uint64_t leave_;
  Enter* enter_;
  Call* call_;
  std::uint64_t interrupts_, transmit_;
  const KtRobot* robot_;
  const std::uint16_t* tx_period_;
};

/// A fault in words: what, where in the program.
[[nodiscard]] std::string describe(const Fault&, const Program&, const Slot&);

}  // namespace kilotwin::behaviours
