// Lines that listeners print: patterns, lines, and text of any kind.
#include "core/experiment/line_pattern.hpp"

#include <gtest/gtest.h>

#include <random>

#include "core/base/error.hpp"

namespace kilotwin {
namespace {

using Octets = std::vector<std::uint8_t>;

TEST(LinePattern, TakesTheValuesOfItsFields) {
  const LinePattern pattern("rx {type}: {data} at {distance} from {sender}");
  const auto line = pattern.match("rx 3: 1 2, 0xff,4 at 61.5 from 17\r");
  ASSERT_TRUE(line);
  EXPECT_EQ(line->type, 3);
  EXPECT_EQ(line->data, (Octets{1, 2, 255, 4}));
  EXPECT_EQ(line->distance_mm, 61.5);
  EXPECT_EQ(line->sender, 17u);
  EXPECT_EQ(LinePattern("{skip} {type} {data}").match("[12.5s] 0 9 8 7 6 5 4 3 2 1")->data,
            (Octets{9, 8, 7, 6, 5, 4, 3, 2, 1}));
  EXPECT_EQ(LinePattern("id={sender}, {data}.").match("id=4,\t7.")->sender, 4u);
}

TEST(LinePattern, OtherLinesSayNothing) {
  const LinePattern pattern("rx {type} {data}");
  for (const char* line :
       {"", "rx", "rx 1", "rx 1 ", "rx 256 1", "rx 1 256", "rx 1 -1", "rx 1 1 2 3 4 5 6 7 8 9 10", "tx 1 2",
        "rx 1 2 battery", "rx 0x 1", "rx 1 99999999999999999999"})
    EXPECT_FALSE(pattern.match(line)) << line;
}

TEST(LinePattern, MistakesAreNamed) {
  EXPECT_EQ(defect_of_line_pattern("{type} {data}"), "");
  EXPECT_EQ(defect_of_line_pattern("{type}"), "{data} is missing; it stands for the octets of the message");
  EXPECT_EQ(defect_of_line_pattern("{data} {data}"), "{data} stands twice; write it once");
  EXPECT_EQ(defect_of_line_pattern("{data} {distance}"),
            "{data} takes all numbers that follow; put a word behind it, as in \"{data} at {distance}\"");
  EXPECT_EQ(defect_of_line_pattern("{date}"),
            "\"{date}\" is no field; there are {data}, {type}, {sender}, {distance} and {skip}");
  EXPECT_NE(defect_of_line_pattern("{"), "");
  EXPECT_NE(defect_of_line_pattern(std::string(300, ' ') + "{data}"), "");
  EXPECT_THROW(LinePattern("{type}"), UserError);
}

TEST(LinePattern, AnyTextIsAPatternOrNotAndALineOrNot) {
  std::mt19937_64 random(7);
  const std::string pieces[] = {"{data}", "{type}", "{sender}", "{distance}", "{skip}", " ",
                                "rx",     "0x",     "9",        ",",          "{",      "}",
                                "\t",     "-1",     "1e9",      "\xff",       "255",    "nan"};
  std::size_t matches = 0;
  for (int n = 0; n < 200'000; ++n) {
    const auto text = [&](std::size_t most) {
      std::string result;
      for (std::uint64_t left = random() % most; left > 0; --left) result += pieces[random() % std::size(pieces)];
      if (random() % 4 == 0) result += static_cast<char>(random());
      return result;
    };
    const std::string words = text(6);
    if (!defect_of_line_pattern(words).empty()) continue;
    // Any text, or what the pattern stands for with an octet changed.
    std::string printed = text(12);
    if (n % 2 == 0) {
      printed = words;
      for (const std::string field : {"{data}", "{type}", "{sender}", "{distance}", "{skip}"}) {
        for (std::size_t at = printed.find(field); at != std::string::npos; at = printed.find(field))
          printed.replace(at, field.size(), std::to_string(random() % 300));
      }
      if (!printed.empty() && random() % 4 == 0) printed[random() % printed.size()] = static_cast<char>(random());
    }
    const auto line = LinePattern(words).match(printed);
    if (!line) continue;
    ++matches;
    ASSERT_GE(line->data.size(), 1u);
    ASSERT_LE(line->data.size(), 9u);
    ASSERT_TRUE(!line->distance_mm || (*line->distance_mm >= 0 && *line->distance_mm <= 1e300));
  }
  EXPECT_GT(matches, 100u);
}

}  // namespace
}  // namespace kilotwin
