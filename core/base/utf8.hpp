/// Whether text is well-formed UTF-8 (Unicode 15, table 3-7).
#pragma once

#include <cstddef>
#include <string_view>

namespace kilotwin {

[[nodiscard]] constexpr bool is_utf8(std::string_view text) {
  const auto octet = [&](std::size_t at) { return static_cast<unsigned char>(text[at]); };
  for (std::size_t at = 0; at < text.size();) {
    const unsigned first = octet(at);
    const std::size_t length = first < 0x80   ? 1
                               : first < 0xc2 ? 0
                               : first < 0xe0 ? 2
                               : first < 0xf0 ? 3
                               : first < 0xf5 ? 4
                                              : 0;
    if (length == 0 || at + length > text.size()) return false;
    // The second octet excludes longer forms than needed, surrogates, and code points above U+10FFFF.
    if (length > 1) {
      const unsigned least = first == 0xe0   ? 0xa0
                             : first == 0xf0 ? 0x90
                                             : 0x80,
                     most = first == 0xed   ? 0x9f
                            : first == 0xf4 ? 0x8f
                                            : 0xbf;
      if (octet(at + 1) < least || octet(at + 1) > most) return false;
    }
    for (std::size_t i = 2; i < length; ++i)
      if (octet(at + i) < 0x80 || octet(at + i) > 0xbf) return false;
    at += length;
  }
  return true;
}

}  // namespace kilotwin
