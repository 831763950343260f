#include "services/behaviours/loop_barriers.hpp"

#include <cstdint>
#include <set>
#include <vector>

#include "services/behaviours/c_tokens.hpp"

namespace kilotwin::behaviours {
namespace {

constexpr std::string_view kBarrier = "({__asm__ volatile(\"\":::\"memory\");}),";

class Marker {
 public:
  explicit Marker(std::string_view text) : text_(text), tokens_(tokens_of(text)) {
    for (std::size_t i = 0; i + 1 < tokens_.size(); ++i) {
      if (tokens_[i].text == "goto") targets_.insert(tokens_[i + 1].text);
    }
  }

  std::string marked() {
    for (std::size_t i = 0; i < tokens_.size(); ++i) {
      const bool opens = i + 1 < tokens_.size() && tokens_[i + 1].text == "(";
      if (opens && tokens_[i].text == "while")
        mark(i + 2, closing(tokens_, i + 1));
      else if (opens && tokens_[i].text == "for")
        mark_for(i + 1, closing(tokens_, i + 1));
      else if (is_label(i))
        insert(tokens_[i + 1].at + 1, "__asm__ volatile(\"\":::\"memory\");");
    }
    std::string result;
    std::size_t from = 0;
    for (const auto& [at, what] : inserts_) {
      result.append(text_.substr(from, at - from)).append(what);
      from = at;
    }
    return result.append(text_.substr(from));
  }

 private:
  struct Insert {
    std::size_t at;
    std::string what;
    bool operator<(const Insert& other) const { return at < other.at; }
  };
  void insert(std::size_t at, std::string_view what) { inserts_.insert({at, std::string(what)}); }

  /// Inserts a barrier into the condition, tokens [first, end).
  void mark(std::size_t first, std::size_t end) {
    if (end >= tokens_.size() || is_declaration(first, end)) return;
    if (first == end) return insert(tokens_[end].at, std::string(kBarrier) + "1");
    insert(tokens_[first].at, std::string(kBarrier) + "(");
    insert(tokens_[end].at, ")");
  }

  void mark_for(std::size_t open, std::size_t close) {
    if (close >= tokens_.size()) return;
    std::vector<std::size_t> semicolons;
    for (std::size_t i = open + 1; i < close; ++i) {
      const char c = tokens_[i].text[0];
      if (c == '(' || c == '[' || c == '{')
        i = closing(tokens_, i);
      else if (c == ';')
        semicolons.push_back(i);
    }
    if (semicolons.size() == 2) mark(semicolons[0] + 1, semicolons[1]);
  }

  /// Whether tokens [first, end) are a declaration `T x = ...`: a word after a word, `*` or `&`, then a single `=`.
  [[nodiscard]] bool is_declaration(std::size_t first, std::size_t end) const {
    for (std::size_t i = first; i + 1 < end; ++i) {
      const char c = tokens_[i].text[0];
      if (c == '(' || c == '[') {
        i = closing(tokens_, i);
        continue;
      }
      if (c != '=') continue;
      if (tokens_[i + 1].text == "=" || i < first + 2) return false;
      const char name = tokens_[i - 1].text[0], before = tokens_[i - 2].text[0];
      return is_word(name) && is_word(before);
    }
    return false;
  }

  [[nodiscard]] bool is_label(std::size_t i) const {
    if (i == 0 || i + 2 >= tokens_.size() || tokens_[i + 1].text != ":" || tokens_[i + 2].text == ":") return false;
    const char before = tokens_[i - 1].text[0];
    return targets_.count(tokens_[i].text) > 0 &&
           (before == ';' || before == '{' || before == '}' || before == ':');
  }

  std::string_view text_;
  std::vector<Token> tokens_;
  std::set<std::string_view> targets_;
  std::multiset<Insert> inserts_;
};

}  // namespace

std::string with_loop_barriers(std::string_view preprocessed) { return Marker(preprocessed).marked(); }

}  // namespace kilotwin::behaviours
