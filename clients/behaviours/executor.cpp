#include "clients/behaviours/executor.hpp"

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <vector>

#include "core/base/error.hpp"

namespace kilotwin::behaviours {

void RobotMemory::resize(std::uint32_t data_octets, std::uint32_t stack_octets) {
  constexpr std::uint32_t kRoom = 256;  // for a stack that grows a little
  const std::uint32_t needed = data_octets + stack_octets;
  if (needed > capacity_) {
    capacity_ = (needed + kRoom + 63) / 64 * 64;
    octets_ = std::make_unique_for_overwrite<std::uint8_t[]>(capacity_);
  }
  data_octets_ = data_octets;
  stack_octets_ = stack_octets;
}

void RobotMemory::reset(const Program& program, const Slot& slot) {
  // What the entry into the main program pops: six registers, the address where it starts, and an end for back-traces.
  std::array<std::uint64_t, 8> frame{};
  frame[6] = slot.image_address() + program.file.table.boot;
  // What a reset does not touch, of a robot that has run before.
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
  if (data.size() != program.data_size() || stack.size() > kStackOctets || stack.size() < 56 ||
      slot.initial_data().empty()) {
    throw RunError(program.name + ": the checkpoint was made with another program");
  }
  resize(static_cast<std::uint32_t>(data.size()), static_cast<std::uint32_t>(stack.size()));
  std::memcpy(octets_.get(), data.data(), data.size());
  std::memcpy(octets_.get() + data_octets_, stack.data(), stack.size());
}

std::string describe(const Fault& fault, const Program& program, const Slot& slot) {
  std::string text;
  char address[32];
  std::snprintf(address, sizeof address, "0x%llx", static_cast<unsigned long long>(fault.address));
  const std::uint64_t stack_bottom = slot.stack_top() - kStackOctets;
  switch (fault.signal) {
    case SIGFPE: text = "division by zero"; break;
    case SIGILL: text = "illegal instruction (abort, or what the compiler knew to be undefined)"; break;
    case SIGSEGV:
    case SIGBUS:
      text = fault.address < stack_bottom && fault.address >= stack_bottom - 4 * kPage ? "stack overflow, address "
                                                                                       : "access to address ";
      text += address;
      break;
    default: text = "stack pointer lost";
  }
  const std::string function = program.file.function_at(fault.code - slot.image_address());
  if (!function.empty()) text += " in " + function + "()";
  return text + " of " + program.name;
}

}  // namespace kilotwin::behaviours
