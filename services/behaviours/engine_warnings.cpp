// Warnings of a behaviours host about robots' programs: each kind once per program, integer overflows once per line.
#include <algorithm>
#include <cstdio>
#include <utility>

#include "services/behaviours/engine.hpp"

namespace kilotwin::behaviours {

/// Whether robot i is the first of its program with such a warning.
bool BehavioursEngine::is_first(std::uint32_t i, Warning warning) {
  std::uint8_t& warned = warned_[plan_.program_of(share_.first + i)];
  const auto bit = static_cast<std::uint8_t>(warning);
  const bool first = (warned & bit) == 0;
  warned |= bit;
  return first;
}

void BehavioursEngine::note_overflows(std::uint32_t i, KtExchange& told, const Program& program, const Slot& slot) {
  // The robot may have overwritten the exchange, so limit its number.
  const std::uint32_t count = std::min<std::uint32_t>(told.overflows, KT_MOST_OVERFLOWS);
  told.overflows = 0;
  for (std::uint32_t n = 0; n < count; ++n) {
    const std::uint64_t code = told.overflow[n];
    if (!overflown_.emplace(plan_.program_of(share_.first + i), code - slot.image_address()).second) continue;
    std::string text = describe_overflow(code, program, slot);
    if (overflows_.insert(text).second) warnings_.push_back({share_.first + i, std::move(text)});
  }
}

void BehavioursEngine::note_full_heap(std::uint32_t i, KtExchange& told, const Program& program, const Slot& slot) {
  const std::uint64_t code = std::exchange(told.heap_full, 0);
  if (is_first(i, Warning::kHeapFull))
    warnings_.push_back({share_.first + i, describe_full_heap(code, program, slot)});
}

void BehavioursEngine::note_wrong_crc(std::uint32_t i, std::uint16_t crc) {
  if (!is_first(i, Warning::kWrongCrc)) return;
  char text[192];
  std::snprintf(
      text, sizeof text,
      "its message has the CRC 0x%04x instead of 0x%04x, so receivers drop it, as on the robot; after each "
      "change of a message set its crc to message_crc(&message)",
      crc, crc ^ crc_error_[i]);
  warnings_.push_back({share_.first + i, text});
}

void BehavioursEngine::note_division(std::uint32_t i, std::uint64_t code, const Program& program,
                                     const Slot& slot) {
  if (!is_first(i, Warning::kDivision)) return;
  warnings_.push_back({share_.first + i, describe_division(code, program, slot)});
}

}  // namespace kilotwin::behaviours
