#include "clients/recorder/utf8.hpp"

#include <cstddef>

namespace kilotwin::recorder {

std::u32string code_points(std::string_view text) {
  std::u32string points;
  for (std::size_t i = 0; i < text.size();) {
    const auto octet = static_cast<unsigned char>(text[i]);
    const std::size_t length = octet < 0x80       ? 1
                               : octet >> 5 == 6  ? 2
                               : octet >> 4 == 14 ? 3
                               : octet >> 3 == 30 ? 4
                                                  : 0;
    char32_t point = length == 1 ? octet : octet & (0x7fu >> length);
    bool right = length > 0 && i + length <= text.size();
    for (std::size_t k = 1; right && k < length; ++k) {
      const auto next = static_cast<unsigned char>(text[i + k]);
      right = next >> 6 == 2;
      point = point << 6 | (next & 0x3fu);
    }
    points += right ? point : U'\uFFFD';
    i += right ? length : 1;
  }
  return points;
}

std::string valid_utf8(std::string_view text) {
  std::string valid;
  for (const char32_t point : code_points(text)) {
    const auto put = [&](unsigned lead, int more) {
      valid += static_cast<char>(lead | point >> 6 * more);
      while (more-- > 0) valid += static_cast<char>(0x80 | (point >> 6 * more & 0x3f));
    };
    if (point < 0x80)
      put(0, 0);
    else if (point < 0x800)
      put(0xc0, 1);
    else if (point < 0x10000)
      put(0xe0, 2);
    else
      put(0xf0, 3);
  }
  return valid;
}

}  // namespace kilotwin::recorder
