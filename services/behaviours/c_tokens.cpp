#include "services/behaviours/c_tokens.hpp"

namespace kilotwin::behaviours {
namespace {

/// Offset after the quoted literal that begins at `at`.
std::size_t end_of_literal(std::string_view text, std::size_t at) {
  const char quote = text[at++];
  while (at < text.size() && text[at] != quote && text[at] != '\n') at += text[at] == '\\' ? 2u : 1u;
  return at < text.size() ? at + 1 : text.size();
}

}  // namespace

std::vector<Token> tokens_of(std::string_view text) {
  std::vector<Token> tokens;
  bool line_begins = true;
  for (std::size_t at = 0; at < text.size();) {
    const char c = text[at];
    std::size_t end = at + 1;
    if (c == '\n') {
      line_begins = true;
      at = end;
      continue;
    }
    if (std::isspace(static_cast<unsigned char>(c)) != 0) {
      at = end;
      continue;
    }
    if (c == '#' && line_begins) {
      while (end < text.size() && text[end] != '\n') ++end;
      at = end;
      continue;
    }
    line_begins = false;
    if (is_word(c)) {
      while (end < text.size() && is_word(text[end])) ++end;
    } else if (c == '"' || c == '\'') {
      end = end_of_literal(text, at);
    }
    tokens.push_back({text.substr(at, end - at), at});
    at = end;
  }
  return tokens;
}

std::size_t closing(const std::vector<Token>& tokens, std::size_t open) {
  int depth = 0;
  for (std::size_t i = open; i < tokens.size(); ++i) {
    const char c = tokens[i].text[0];
    if (c == '(' || c == '[' || c == '{') ++depth;
    if ((c == ')' || c == ']' || c == '}') && --depth == 0) return i;
  }
  return tokens.size();
}

}  // namespace kilotwin::behaviours
