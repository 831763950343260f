// The state of a processor: in memory, to go back a moment, and as octets, for checkpoints.
//
// libsimavr keeps a processor in one block, in its memories and in the values of its signals. The block holds pointers: into
// itself, and to functions of the library. As octets it is written as its difference from the state at cycle 0, word by
// word, pointers as offsets.
#include <malloc.h>
#include <simavr/avr_eeprom.h>
#include <simavr/avr_flash.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_core.h>

#include <algorithm>
#include <cstring>

#include "core/base/error.hpp"
#include "services/comm/firmware/mcu.hpp"

extern "C" {
// Where this program's code begins and ends, by the linker.
extern const char __executable_start;  // NOLINT
extern const char __etext;             // NOLINT
}

namespace kilotwin::firmware {
namespace {

/// A signal: its value and whether it has ever been raised.
constexpr std::size_t kLine = 5;

enum WordKind : char { kPlain = 0, kIntoBlock = 1, kIntoCode = 2 };

template <class T> void append(std::string& octets, const T& value) {
  octets.append(reinterpret_cast<const char*>(&value), sizeof value);
}

class Reader {
 public:
  explicit Reader(const std::string& octets) : octets_(octets) {}
  template <class T> T next() {
    T value;
    take(&value, sizeof value);
    return value;
  }
  void take(void* to, std::size_t size) {
    if (octets_.size() - at_ < size) {
      throw RunError("a firmware robot's part of the checkpoint ends early; resume from another one");
    }
    std::memcpy(to, octets_.data() + at_, size);
    at_ += size;
  }

 private:
  const std::string& octets_;
  std::size_t at_ = 0;
};

std::uint64_t address_of(const void* p) { return reinterpret_cast<std::uint64_t>(p); }

/// Tells two builds apart: where some functions of the library lie.
std::uint64_t fingerprint() {
  const std::uint64_t base = address_of(&__executable_start);
  std::uint64_t sum = address_of(&__etext) - base;
  for (const std::uint64_t function :
       {reinterpret_cast<std::uint64_t>(&avr_run_one), reinterpret_cast<std::uint64_t>(&avr_cycle_timer_process),
        reinterpret_cast<std::uint64_t>(&avr_interrupt_reset)}) {
    sum = sum * 0x9e3779b97f4a7c15u + (function - base);
  }
  return sum;
}

}  // namespace

std::vector<Mcu::Range> Mcu::ranges() const {
  auto* const block = reinterpret_cast<std::uint8_t*>(avr_);
  // The table of registers in its middle, half of it, never changes.
  const std::size_t table = offsetof(avr_t, io), rest = offsetof(avr_t, flash);
  const std::size_t size = malloc_usable_size(avr_) / 8 * 8;
  std::vector<Range> result{{block, table}, {block + rest, size - rest}, {avr_->data, avr_->ramend + 1u}};
  for (avr_io_t* module = avr_->io_port; module != nullptr; module = module->next) {
    if (std::strcmp(module->kind, "eeprom") == 0) {
      result.push_back({reinterpret_cast<avr_eeprom_t*>(module)->eeprom, kEepromOctets});
    } else if (std::strcmp(module->kind, "flash") == 0) {
      const auto& writer = *reinterpret_cast<avr_flash_t*>(module);
      result.push_back({reinterpret_cast<std::uint8_t*>(writer.tmppage), writer.spm_pagesize});
      result.push_back({writer.tmppage_used, writer.spm_pagesize / 2u});
    }
  }
  return result;
}

void Mcu::mark() {
  const std::vector<Range>& all = ranges_.empty() ? ranges_ = ranges() : ranges_;
  std::size_t size = lines_.size() * kLine;
  for (const Range& range : all) size += range.octets;
  marked_.resize(size);
  std::uint8_t* at = marked_.data();
  for (const Range& range : all) {
    std::memcpy(at, range.begin, range.octets);
    at += range.octets;
  }
  for (const avr_irq_t* line : lines_) {
    std::memcpy(at, &line->value, 4);
    at[4] = line->flags;
    at += kLine;
  }
  marked_state_ = state_;
  if (core_) core_->mark();
  replaced_.clear();
}

void Mcu::rewind() {
  const std::uint8_t* at = marked_.data();
  for (const Range& range : ranges_) {
    std::memcpy(range.begin, at, range.octets);
    at += range.octets;
  }
  for (avr_irq_t* line : lines_) {
    std::memcpy(&line->value, at, 4);
    line->flags = at[4];
    at += kLine;
  }
  state_ = marked_state_;
  if (core_) core_->rewind();
  for (const Page& page : replaced_) put_page(page.address, page.octets.data());
  replaced_.clear();
}

/// The state at cycle 0, but for what libsimavr does not hold.
void Mcu::return_to_pristine() {
  interrupt_core();
  mark();
  marked_ = pristine_;
  rewind();
  state_ = State();
}

std::string Mcu::save() const {
  settle();
  std::string octets;
  append(octets, fingerprint());
  append(octets, state_.dark_at);
  append(octets, state_.powered_down);
  append(octets, state_.conversions);
  append(octets, state_.fault_at);
  append(octets, state_.halt);
  for (const OwnCycles cycles : {state_.motors_from, state_.full_since, state_.full_cycles, state_.changed_at})
    append(octets, cycles);
  for (const std::uint8_t duty : {state_.left, state_.right, state_.steady_left, state_.steady_right,
                                  state_.before_left, state_.before_right})
    append(octets, duty);

  const std::uint64_t block = address_of(avr_), block_end = block + malloc_usable_size(avr_);
  const std::uint64_t code = address_of(&__executable_start), code_end = address_of(&__etext);
  const std::uint8_t* before = pristine_.data();
  std::uint32_t index = 0, changed = 0;
  std::string words;
  for (const Range& range : ranges_) {
    for (std::size_t i = 0; i < range.octets; i += 8, ++index) {
      const std::size_t size = std::min<std::size_t>(8, range.octets - i);
      if (std::memcmp(range.begin + i, before + i, size) == 0) continue;
      std::uint64_t word = 0;
      std::memcpy(&word, range.begin + i, size);
      char kind = kPlain;
      if (word >= block && word < block_end) kind = kIntoBlock, word -= block;
      if (word >= code && word < code_end) kind = kIntoCode, word -= code;
      append(words, index);
      append(words, kind);
      append(words, word);
      ++changed;
    }
    before += range.octets;
  }
  append(octets, changed);
  octets += words;
  for (const avr_irq_t* line : lines_) {
    append(octets, line->value);
    append(octets, line->flags);
  }
  // Pages of flash that a boot loader has written.
  std::uint32_t pages = 0;
  std::string written;
  for (std::uint32_t page = 0; page < kFlashOctets; page += kPageOctets) {
    if (std::memcmp(avr_->flash + page, program_.data() + page, kPageOctets) == 0) continue;
    append(written, page);
    written.append(reinterpret_cast<const char*>(avr_->flash + page), kPageOctets);
    ++pages;
  }
  append(octets, pages);
  octets += written;
  return octets;
}

void Mcu::load(const std::string& octets) {
  Reader reader(octets);
  if (reader.next<std::uint64_t>() != fingerprint()) {
    throw RunError(
        "the checkpoint's firmware robots were saved by another build of this program; resume with that one");
  }
  return_to_pristine();
  state_.dark_at = reader.next<OwnCycles>();
  state_.powered_down = reader.next<OwnCycles>();
  state_.conversions = reader.next<std::uint32_t>();
  state_.fault_at = reader.next<std::uint32_t>();
  state_.halt = reader.next<Halt>();
  for (OwnCycles* cycles : {&state_.motors_from, &state_.full_since, &state_.full_cycles, &state_.changed_at})
    *cycles = reader.next<OwnCycles>();
  for (std::uint8_t* duty : {&state_.left, &state_.right, &state_.steady_left, &state_.steady_right,
                             &state_.before_left, &state_.before_right})
    *duty = reader.next<std::uint8_t>();

  const auto changed = reader.next<std::uint32_t>();
  std::size_t range = 0;
  std::uint32_t first = 0;  // index of the range's first word
  for (std::uint32_t n = 0; n < changed; ++n) {
    const auto index = reader.next<std::uint32_t>();
    const auto kind = reader.next<char>();
    auto word = reader.next<std::uint64_t>();
    const auto length = [&](std::size_t r) { return static_cast<std::uint32_t>((ranges_[r].octets + 7) / 8); };
    while (range < ranges_.size() && index - first >= length(range)) first += length(range++);
    if (range == ranges_.size() || index < first)
      throw RunError("a firmware robot's part of the checkpoint is damaged");
    if (kind == kIntoBlock) word += address_of(avr_);
    if (kind == kIntoCode) word += address_of(&__executable_start);
    const std::size_t at = std::size_t{index - first} * 8;
    std::memcpy(ranges_[range].begin + at, &word, std::min<std::size_t>(8, ranges_[range].octets - at));
  }
  for (avr_irq_t* line : lines_) {
    line->value = reader.next<std::uint32_t>();
    line->flags = reader.next<std::uint8_t>();
  }
  for (auto pages = reader.next<std::uint32_t>(); pages > 0; --pages) {
    const auto page = reader.next<std::uint32_t>();
    if (page % kPageOctets != 0 || page >= kFlashOctets) throw RunError("a firmware robot's checkpoint is damaged");
    std::array<std::uint8_t, kPageOctets> written{};
    reader.take(written.data(), written.size());
    put_page(page, written.data());
  }
  flashes_.clear();
  printed_.clear();
  mark();
}

}  // namespace kilotwin::firmware
