#include "core/base/utf8.hpp"

#include <gtest/gtest.h>

#include <string>

namespace kilotwin {
namespace {

/// A code point in UTF-8, by the definition.
std::string encoded(char32_t c) {
  const auto tail = [&](int shift) { return static_cast<char>(0x80 | (c >> shift & 0x3f)); };
  if (c < 0x80) return {static_cast<char>(c)};
  if (c < 0x800) return {static_cast<char>(0xc0 | c >> 6), tail(0)};
  if (c < 0x10000) return {static_cast<char>(0xe0 | c >> 12), tail(6), tail(0)};
  return {static_cast<char>(0xf0 | c >> 18), tail(12), tail(6), tail(0)};
}

TEST(Utf8, EveryCodePointButSurrogatesIsWellFormed) {
  for (char32_t c = 0; c < 0x120000; ++c) {
    const bool is_right = c < 0x110000 && !(c >= 0xd800 && c < 0xe000);
    ASSERT_EQ(is_utf8("a" + encoded(c) + "b"), is_right) << std::hex << static_cast<std::uint32_t>(c);
  }
}

TEST(Utf8, LatinTextsPartsOfCharactersAndLongFormsAreNot) {
  for (const char* wrong : {"caf\xe9", "\x80", "\xe2\x82", "\xc0\xaf", "\xe0\x80\xaf", "\xf0\x80\x80\xaf", "\xff"})
    EXPECT_FALSE(is_utf8(wrong)) << wrong;
  EXPECT_TRUE(is_utf8(""));
  EXPECT_TRUE(is_utf8("caf\xc3\xa9"));
}

}  // namespace
}  // namespace kilotwin
