#include "clients/doors/tally.hpp"

#include <fmt/format.h>

#include "core/base/say.hpp"

namespace kilotwin::doors {

bool Tally::left_out(const std::string& reason, const std::string& example) {
  Count& count = left_out_[reason];
  if (++count.times > 1) return false;
  count.example = one_line(example, 80);
  return true;
}

std::uint64_t Tally::left_out_for(const std::string& reason) const {
  const auto found = left_out_.find(reason);
  return found == left_out_.end() ? 0 : found->second.times;
}

std::string Tally::in_words() const {
  std::string text = fmt::format("{} frames with {} poses", frames_, poses_);
  const char* before = "; left out: ";
  for (const auto& [reason, count] : left_out_) {
    text += fmt::format("{}{} {}", before, count.times, reason);
    if (!count.example.empty()) text += fmt::format(" (the first: {})", count.example);
    before = ", ";
  }
  return text;
}

}  // namespace kilotwin::doors
