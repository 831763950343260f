#include "services/behaviours/executor.hpp"

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <optional>
#include <vector>

#include "core/base/error.hpp"

namespace kilotwin::behaviours {

void RobotMemory::resize(std::uint32_t data_octets, std::uint32_t stack_octets) {
  constexpr std::uint32_t kRoom = 256;  // spare octets, so that a slightly larger stack needs no reallocation
  const std::uint32_t needed = data_octets + stack_octets;
  if (needed > capacity_) {
    capacity_ = (needed + kRoom + 63) / 64 * 64;
    octets_ = std::make_unique_for_overwrite<std::uint8_t[]>(capacity_);
  }
  data_octets_ = data_octets;
  stack_octets_ = stack_octets;
}

void RobotMemory::reset(const Program& program, const Slot& slot) {
  // The frame that the entry into the main program pops: six registers, the start address, and a null to end back-traces.
  std::array<std::uint64_t, 8> frame{};
  frame[6] = slot.image_address() + program.file.table.boot;
  // A robot that has run before keeps the ranges that a reset preserves.
  std::vector<std::uint8_t> kept;
  if (octets_) {
    for (const ElfFile::Range& range : program.file.kept) {
      const std::uint8_t* const first = octets_.get() + (range.first - program.file.data.first);
      kept.insert(kept.end(), first, first + (range.last - range.first));
    }
  }
  resize(static_cast<std::uint32_t>(program.data_size()), sizeof frame);
  std::memcpy(octets_.get(), slot.initial_data().data(), data_octets_);
  auto from = kept.cbegin();
  if (!kept.empty()) {
    for (const ElfFile::Range& range : program.file.kept) {
      const auto size = static_cast<std::ptrdiff_t>(range.last - range.first);
      std::copy_n(from, size, octets_.get() + (range.first - program.file.data.first));
      from += size;
    }
  }
  std::memcpy(octets_.get() + data_octets_, frame.data(), sizeof frame);
}

void RobotMemory::restore(const Program& program, const Slot& slot, std::span<const std::uint8_t> data,
                          std::span<const std::uint8_t> stack) {
  const ElfFile::Range& heap = program.file.heap;
  if (data.size() < program.data_size() || data.size() > program.data_size() + (heap.last - heap.first) ||
      stack.size() > kStackOctets || stack.size() < 56 || slot.initial_data().empty()) {
    throw RunError(program.name + ": the checkpoint was made with another program");
  }
  resize(static_cast<std::uint32_t>(data.size()), static_cast<std::uint32_t>(stack.size()));
  std::memcpy(octets_.get(), data.data(), data.size());
  std::memcpy(octets_.get() + data_octets_, stack.data(), stack.size());
}

namespace {

/// A busy wait is looked for in this many slices; a slice ends at the next test of the budget.
constexpr int kMostSlices = 24;
/// Value of Main::wait_period for a loop with a single test. No period is that short.
constexpr std::int32_t kOneTest = 1;

/// A copy of the state of the robot in a slot.
class Snapshot {
 public:
  void take(const Slot& slot, std::size_t data_octets, const RobotThread& thread) {
    robot_stack_ = thread.robot_stack;
    const std::uint64_t size = stack_octets(slot);
    octets_.resize(data_octets + size);
    std::memcpy(octets_.data(), slot.data(), data_octets);
    std::memcpy(octets_.data() + data_octets, stack(), size);
  }
  [[nodiscard]] bool equals(const Slot& slot, std::size_t data_octets, const RobotThread& thread) const {
    return robot_stack_ == thread.robot_stack && octets_.size() == data_octets + stack_octets(slot) &&
           std::memcmp(octets_.data(), slot.data(), data_octets) == 0 &&
           std::memcmp(octets_.data() + data_octets, stack(), stack_octets(slot)) == 0;
  }

 private:
  [[nodiscard]] std::uint64_t stack_octets(const Slot& slot) const {
    const std::uint64_t size = slot.stack_top() - robot_stack_;
    return size <= kStackOctets ? size : 0;
  }
  [[nodiscard]] const void* stack() const { return reinterpret_cast<const void*>(robot_stack_); }  // NOLINT

  std::uint64_t robot_stack_ = 0;
  std::vector<std::uint8_t> octets_;
};

/// " in f() at FILE:LINE", as far as the program's tables tell.
std::string place(std::uint64_t code, const Program& program, const Slot& slot) {
  const std::uint64_t offset = code - slot.image_address();
  const std::string function = program.file.function_at(offset);
  const auto line = program.file.lines.find(offset);
  return (function.empty() ? "" : " in " + function + "()") +
         (line ? " at " + line->file + ':' + std::to_string(line->line) : " of " + program.name);
}

}  // namespace

/// Runs a main program that may be in a busy wait until it waits or has used up the tick. If a test finds the robot in the same
/// state as an earlier test, only an interrupt can end the loop. Its rounds need not be executed then: only the phase at the end
/// of the tick matters.
void Executor::run_busy_wait(Main& main, std::int32_t previous_period) const {
  thread_local Snapshot snapshot;
  if (robot_->looped != 0) {
    // The last tick ended in a loop that reads nothing that an interrupt could change. If the state repeats, the loop is
    // endless.
    snapshot.take(slot_, data_octets(), thread_);
    if (!run(main, 0)) return;
    if (snapshot.equals(slot_, data_octets(), thread_)) {
      main.fault = fail({Fault::kEndlessLoop, 0, thread_.place});
      return;
    }
    if (previous_period == 0 && main.left >= 0 && !run(main, std::min(main.left, kUnsuspected))) return;
  }
  int next_snapshot = 0, snapshot_slice = 0;
  std::int32_t snapshot_left = 0;
  // A loop with several tests is probably the loop of the last tick, so run whole rounds of its period. Run one round before the
  // first snapshot, because an interrupt may have changed a register.
  if (previous_period > kOneTest && main.left >= 0 && !run(main, std::min(previous_period, main.left + 1) - 1))
    return;
  for (int slice = 0; slice < kMostSlices && main.left >= 0; ++slice) {
    const bool whole_round = slice == 0 && previous_period > kOneTest;
    if (slice == next_snapshot) {
      snapshot.take(slot_, data_octets(), thread_);
      snapshot_slice = slice;
      snapshot_left = main.left;
      next_snapshot = 2 * slice + 1;
    }
    if (!run(main, whole_round ? std::min(previous_period, main.left + 1) - 1 : 0)) return;
    if (!snapshot.equals(slot_, data_octets(), thread_)) continue;
    const std::int32_t period = snapshot_left - main.left;
    const bool one_test = slice == snapshot_slice && !whole_round;
    main.wait_period = one_test ? kOneTest : period;
    if (main.left >= 0) main.left %= period;
    if (one_test && main.left >= 0) main.left -= period;
    break;
  }
  if (main.left >= 0) run(main, main.left);
}

const Fault* Executor::transmit(const KtMessage*& message, std::int32_t& cycles) const {
  std::uint64_t sends = 0;
  const Fault* const fault = call(transmit_, sends, cycles);
  message = fault == nullptr && sends == 1 ? &slot_.exchange()->message : nullptr;
  return fault;
}

namespace {

/// The word on a stack of the slot at this address; nothing where there is no such stack.
std::optional<std::uint64_t> word_on_stack(std::uint64_t address, const Slot& slot) {
  for (const std::uint64_t top : {slot.stack_top(), slot.interrupt_stack_top()}) {
    if (address % 8 != 0 || address < top - kStackOctets || address > top - 8) continue;
    return *reinterpret_cast<const std::uint64_t*>(address);  // NOLINT
  }
  return std::nullopt;
}

bool is_code(std::uint64_t address, const Program& program, const Slot& slot) {
  return !program.file.function_at(address - slot.image_address()).empty();
}

/// A description of a jump out of the program; empty: the fault is none.
std::string describe_jump(const Fault& fault, const Program& program, const Slot& slot) {
  char address[32];
  constexpr std::uint8_t kReturn = 0xc3;
  const char* const overwritten =
      "its return address is overwritten; it writes past the end of an array of its own";
  if (is_code(fault.code, program, slot)) {
    // An address of more than 47 bits faults at the instruction itself.
    const std::uint8_t instruction = *reinterpret_cast<const std::uint8_t*>(fault.code);  // NOLINT
    if (fault.address != 0 || instruction != kReturn) return "";
    const auto target = word_on_stack(fault.stack, slot);
    if (!target || *target >> 47 == 0) return "";
    return program.file.function_at(fault.code - slot.image_address()) + "() returns to nowhere: " + overwritten;
  }
  if (fault.address != fault.code) return "";
  std::snprintf(address, sizeof address, "0x%llx", static_cast<unsigned long long>(fault.address));
  if (word_on_stack(fault.stack - 8, slot) == fault.code)
    return std::string("a function returns to address ") + address + ": " + overwritten;
  const auto caller = word_on_stack(fault.stack, slot);
  if (!caller || !is_code(*caller - 1, program, slot)) return "";
  return std::string("call of a function at address ") + address + place(*caller - 1, program, slot);
}

}  // namespace

std::string describe(const Fault& fault, const Program& program, const Slot& slot) {
  std::string text;
  char address[32];
  std::snprintf(address, sizeof address, "0x%llx", static_cast<unsigned long long>(fault.address));
  const std::uint64_t stack_bottom = slot.stack_top() - kStackOctets;
  switch (fault.signal) {
    case SIGFPE: text = "arithmetic"; break;
    case Fault::kEndlessLoop: text = "endless loop"; break;
    case Fault::kCallbackOverrun:
      text = std::string("does not return from ") + (fault.address == KT_IN_TX_SUCCESS ? "kilo_message_tx_success"
                                                     : fault.address == KT_IN_RX       ? "kilo_message_rx"
                                                                                       : "kilo_message_tx");
      text += ": it loops";
      break;
    case SIGSYS: text = "system call " + std::to_string(fault.address) + ", which a robot does not have"; break;
    case SIGTRAP: text = "breakpoint instruction"; break;
    case SIGILL:
      if (program.file.function_at(fault.code - slot.image_address()) == "abort") {
        const auto caller = word_on_stack(fault.stack, slot);
        if (caller && is_code(*caller - 1, program, slot))
          return "abort(), or a failed assertion," + place(*caller - 1, program, slot);
      }
      text = "illegal instruction (abort, or what the compiler knew to be undefined)";
      break;
    case SIGSEGV:
    case SIGBUS:
      text = describe_jump(fault, program, slot);
      if (!text.empty()) return text;
      text = fault.address < stack_bottom && fault.address >= stack_bottom - 4 * kPage ? "stack overflow, address "
                                                                                       : "access to address ";
      text += address;
      break;
    case Fault::kBeforeVariables: return "a write before its first variable, by code of " + program.name;
    default: text = "stack pointer lost";
  }
  return text + place(fault.code, program, slot);
}

std::string describe_overflow(std::uint64_t code, const Program& program, const Slot& slot) {
  return "an int overflows" + place(code - 1, program, slot) +
         ": it has 16 bits, -32768 to 32767, and wraps as on the robot; use int32_t";
}

std::string describe_full_heap(std::uint64_t code, const Program& program, const Slot& slot) {
  return "the heap is full: there is no room for what is asked for" + place(code - 1, program, slot) +
         "; it has 64 KiB here, and a robot has 2 KiB of RAM in all";
}

std::string describe_division(std::uint64_t code, const Program& program, const Slot& slot) {
  return "division by zero" + place(code, program, slot) +
         "; the quotient is all ones (of a negative number 1), the remainder the dividend, as on the robot";
}

}  // namespace kilotwin::behaviours
