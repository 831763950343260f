/// A loaded program: copies of its image at fixed addresses. Pointers in a robot's memory and on its stack are therefore valid in
/// every process, on every machine and after every checkpoint.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "services/behaviours/elf_file.hpp"

namespace kilotwin::behaviours {

/// Number of copies per program. Robot r runs in slot r % kSlots, so up to kSlots robots of a program run at the same time.
inline constexpr std::uint32_t kSlots = 8;
/// Address range of images. It is free in position-independent executables, also under sanitizers.
inline constexpr std::uint64_t kFirstAddress = 0x20000000, kLastAddress = 0x70000000;
inline constexpr std::uint64_t kAddressStep = 64 * 1024;  ///< alignment of slots
inline constexpr std::uint64_t kStackOctets = 64 * 1024;

/// One copy of an image with its stacks. From low to high addresses: main stack, interrupt stack, surroundings, exchange, image,
/// each followed by a guard page. Code and constants are not writable; data and stacks are not executable.
class Slot {
 public:
  /// Maps the slot. Throws RunError if the addresses are in use or memory is short.
  Slot(const ElfFile&, std::uint64_t address);
  ~Slot();
  Slot(const Slot&) = delete;
  Slot& operator=(const Slot&) = delete;

  /// Octets of address space that a slot of this program occupies.
  [[nodiscard]] static std::uint64_t size(const ElfFile&);

  /// A function or variable of the image at an offset from ElfFile::table.
  template <class T> [[nodiscard]] T at(std::uint64_t offset) const {
    return reinterpret_cast<T>(image_ + offset);  // NOLINT
  }
  [[nodiscard]] KtExchange* exchange() const { return reinterpret_cast<KtExchange*>(exchange_); }  // NOLINT
  [[nodiscard]] KtSurroundings* surroundings() const {
    return reinterpret_cast<KtSurroundings*>(surroundings_);  // NOLINT
  }
  /// Start of the robot's data, which its heap follows.
  [[nodiscard]] std::uint8_t* data() const { return at<std::uint8_t*>(data_offset_); }
  /// Clears the watched octets before the robot's data. False if one was not zero.
  [[nodiscard]] bool clear_before_data() const {
    using Words = std::uint64_t __attribute__((vector_size(16), aligned(8), may_alias));
    Words any{};
    const auto* const end = reinterpret_cast<const Words*>(data());  // NOLINT
    for (const Words* pair = end - watched_words_ / 2; pair < end; ++pair) any |= *pair;
    if ((any[0] | any[1]) == 0) return true;
    std::memset(data() - 8 * watched_words_, 0, 8 * watched_words_);
    return false;
  }
  /// Address after the highest octet of the main stack; aligned to 16.
  [[nodiscard]] std::uint64_t stack_top() const { return stack_top_; }
  [[nodiscard]] std::uint64_t interrupt_stack_top() const { return interrupt_stack_top_; }
  [[nodiscard]] std::uint64_t image_address() const { return image_; }
  /// The robot's data at reset.
  [[nodiscard]] const std::vector<std::uint8_t>& initial_data() const { return initial_data_; }

  std::mutex mutex;  ///< held while robots run in this slot

 private:
  std::uint64_t address_, size_, stack_top_, interrupt_stack_top_, surroundings_, exchange_, image_, data_offset_,
      watched_words_;  ///< even
  std::vector<std::uint8_t> initial_data_;
};

/// A program with all its slots.
class Program {
 public:
  /// Loads the program at this address, or returns it if this process has loaded it there. Throws RunError if another program
  /// occupies the address or memory is short.
  [[nodiscard]] static std::shared_ptr<Program> load(ElfFile file, const std::string& name,
                                                     const std::string& sha256, std::uint64_t address);
  /// Octets of address space that the program occupies.
  [[nodiscard]] static std::uint64_t size(const ElfFile& file) { return kSlots * Slot::size(file); }

  Program(ElfFile file, std::string name, std::string sha256, std::uint64_t address);

  const ElfFile file;
  const std::string name;
  const std::string sha256;
  const std::uint64_t address, end;  ///< the program occupies [address, end)
  [[nodiscard]] Slot& slot(std::uint32_t index) const { return *slots_[index]; }
  [[nodiscard]] std::uint64_t data_size() const { return file.data.last - file.data.first; }

 private:
  std::vector<std::unique_ptr<Slot>> slots_;
};

}  // namespace kilotwin::behaviours
