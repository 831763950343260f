#include "core/base/base64.hpp"

#include <cstdint>

namespace kilotwin {

std::string base64(std::string_view octets) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((octets.size() + 2) / 3 * 4);
  for (std::size_t k = 0; k < octets.size(); k += 3) {
    std::uint32_t three = 0;
    for (std::size_t i = 0; i < 3; ++i)
      three = three << 8 | (k + i < octets.size() ? static_cast<std::uint8_t>(octets[k + i]) : 0U);
    for (std::size_t i = 0; i < 4; ++i) text += k + i <= octets.size() ? kDigits[three >> (18 - 6 * i) & 63] : '=';
  }
  return text;
}

}  // namespace kilotwin
