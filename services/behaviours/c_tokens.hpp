/// Words of C text, for the passes that insert code into preprocessed programs.
#pragma once

#include <cctype>
#include <string_view>
#include <vector>

namespace kilotwin::behaviours {

struct Token {
  std::string_view text;
  std::size_t at = 0;  ///< offset in the text
};

/// Whether a character may stand in an identifier or a number.
[[nodiscard]] inline bool is_word(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '$';
}

/// Splits the text into words, literals and single characters. Skips white space and lines that begin with '#'.
[[nodiscard]] std::vector<Token> tokens_of(std::string_view text);

/// Index of the bracket that closes the one at `open`, or the number of tokens if there is none.
[[nodiscard]] std::size_t closing(const std::vector<Token>& tokens, std::size_t open);

}  // namespace kilotwin::behaviours
