#include "services/behaviours/robot_int.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <vector>

#include "services/behaviours/c_tokens.hpp"

namespace kilotwin::behaviours {
namespace {

template <std::size_t N> bool is_one_of(std::string_view word, const std::array<std::string_view, N>& words) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

bool is_identifier(std::string_view word) { return is_word(word[0]) && (word[0] < '0' || word[0] > '9'); }

/// Words of which declarations are made, besides names.
bool is_specifier(std::string_view word) {
  static constexpr std::array<std::string_view, 21> kWords{
      "int",     "signed", "unsigned",     "short",  "long",     "char",          "double",
      "float",   "const",  "volatile",     "static", "extern",   "register",      "inline",
      "typedef", "auto",   "__volatile__", "_Bool",  "_Complex", "__extension__", "__inline__"};
  return is_one_of(word, kWords);
}

/// Offsets at which lines of another file begin, with whether they are of a system header: "# LINE "FILE" FLAGS", flag 3.
std::map<std::size_t, bool> system_parts(std::string_view text) {
  std::map<std::size_t, bool> parts{{0, false}};
  for (std::size_t at = 0; at < text.size();) {
    std::size_t end = text.find('\n', at);
    if (end == std::string_view::npos) end = text.size();
    const std::string_view line = text.substr(at, end - at);
    if (line.starts_with("# ") && line.find('"') != std::string_view::npos) {
      const std::string_view flags = line.substr(line.rfind('"') + 1);
      parts[end] = flags.find('3') != std::string_view::npos;
    }
    at = end + 1;
  }
  return parts;
}

class Narrower {
 public:
  explicit Narrower(std::string_view text) : text_(text), tokens_(tokens_of(text)), parts_(system_parts(text)) {}

  std::string narrowed() {
    int depth = 0;
    for (std::size_t i = 0; i < tokens_.size(); ++i) {
      const std::string_view word = tokens_[i].text;
      if (word == "{") ++depth;
      if (word == "}") --depth;
      if (is_of_system(tokens_[i].at)) continue;
      if (word == "__builtin_va_arg" || word == "__attribute__" || word == "__asm__" || word == "asm" ||
          (word == "enum" && (is(i + 1, "{") || is(i + 2, "{")))) {
        i = std::min(closing(tokens_, i + 1), tokens_.size() - 1);
      } else if (is_specifier(word)) {
        i = declaration(i, depth) - 1;
      } else if (word[0] >= '0' && word[0] <= '9') {
        literal(i);
      } else if (depth > 0) {
        store(i);
      }
    }
    return edited();
  }

 private:
  static constexpr std::size_t kNowhere = static_cast<std::size_t>(-1);
  struct Edit {
    std::size_t at, removed;
    std::string text;
  };

  [[nodiscard]] bool is_of_system(std::size_t at) const { return std::prev(parts_.upper_bound(at))->second; }
  [[nodiscard]] bool is(std::size_t i, std::string_view text) const {
    return i < tokens_.size() && tokens_[i].text == text;
  }
  /// Whether tokens i and i + 1 stand without a space between them.
  [[nodiscard]] bool is_joined(std::size_t i) const {
    return i + 1 < tokens_.size() && tokens_[i].at + tokens_[i].text.size() == tokens_[i + 1].at;
  }
  void insert(std::size_t at, std::string text) { edits_.push_back({at, 0, std::move(text)}); }
  void replace(std::size_t token, std::size_t count, std::string text) {
    const Token& last = tokens_[token + count - 1];
    edits_.push_back({tokens_[token].at, last.at + last.text.size() - tokens_[token].at, std::move(text)});
  }

  /// Handles a run of specifiers from token `i` on; returns the index after it.
  std::size_t declaration(std::size_t i, int depth) {
    static constexpr std::array<std::string_view, 6> kOthers{"short", "char",  "double",
                                                             "float", "_Bool", "_Complex"};
    static constexpr std::array<std::string_view, 3> kKept{"static", "extern", "typedef"};
    std::size_t end = i, sign = kNowhere, plain = kNowhere, wide = kNowhere;
    int longs = 0;
    bool other = false, keeps = false, has_sign = true;
    for (; end < tokens_.size() && is_specifier(tokens_[end].text); ++end) {
      const std::string_view word = tokens_[end].text;
      if (word == "int") plain = end;
      if (word == "signed" || word == "unsigned") sign = end;
      if (word == "long") wide = end, ++longs;
      has_sign = has_sign && word != "unsigned";
      other = other || is_one_of(word, kOthers);
      keeps = keeps || is_one_of(word, kKept);
    }
    if (other || longs > 1) return end;
    if (longs == 1) {
      replace(wide, 1, "int");
      if (plain != kNowhere) replace(plain, 1, "");
      return end;
    }
    if (plain != kNowhere)
      replace(plain, 1, "short");
    else if (sign != kNowhere)
      insert(tokens_[sign].at + tokens_[sign].text.size(), " short");
    else
      return end;
    if (has_sign && depth > 0 && !keeps) initial_values(end);
    return end;
  }

  /// Removes the L of an integer literal, whose 32 bits are those of an int here.
  void literal(std::size_t i) {
    std::string_view word = tokens_[i].text;
    const bool is_hex = word.size() > 1 && (word[1] == 'x' || word[1] == 'X');
    const bool is_fraction = (i > 0 && is(i - 1, ".") && is_joined(i - 1)) || (is(i + 1, ".") && is_joined(i)) ||
                             (!is_hex && word.find_first_of("eE.") != std::string_view::npos);
    const std::size_t first = word.find_first_of("lL");
    if (is_fraction || first == std::string_view::npos || word.find_last_of("lL") != first) return;
    edits_.push_back({tokens_[i].at + first, 1, ""});
  }

  /// `x = VALUE, y = VALUE;` after the type.
  void initial_values(std::size_t i) {
    while (i + 1 < tokens_.size() && is_identifier(tokens_[i].text)) {
      if (is(i + 1, "=") && !is(i + 2, "{") && !is(i + 2, "=")) {
        const std::size_t end = end_of_value(i + 2);
        if (computes(i + 2, end)) test_value(i + 2, end, "1");
        i = end - 1;
      }
      if (!is(i + 1, ",")) return;
      i += 2;
    }
  }

  /// Handles a store whose operator begins at token `i`.
  void store(std::size_t i) {
    const char op = tokens_[i].text[0];
    if (i < last_handled_) return;
    if ((op == '+' || op == '-' || op == '*') && is_joined(i) && is(i + 1, "=")) {
      const std::size_t first = place_before(i);
      if (first == kNowhere) return;
      change(first, i, op, i + 2, end_of_value(i + 2), 2);
    } else if ((op == '+' || op == '-') && is_joined(i) && tokens_[i + 1].text[0] == op) {
      step(i, op);
    } else if (op == '=' && !is(i + 1, "=") &&
               (i == 0 || !is_joined(i - 1) || is_word(tokens_[i - 1].text[0]) || is(i - 1, "]") ||
                is(i - 1, ")"))) {
      const std::size_t first = place_before(i), end = end_of_value(i + 1);
      if (first == kNowhere || !computes(i + 1, end)) return;
      test_value(i + 1, end, "_Generic((" + text_of(first, i) + "),short:1,default:0)");
    }
  }

  /// x++; or ++x; as statements.
  void step(std::size_t i, char op) {
    const auto ends = [this](std::size_t token) { return is(token, ";") || is(token, ")") || is(token, ","); };
    if (ends(i + 2)) {
      if (const std::size_t first = place_before(i); first != kNowhere) change(first, i, op, kNowhere, i + 2, 2);
      return;
    }
    if (!is_boundary(i)) return;
    std::size_t end = i + 2;
    while (end < tokens_.size() && !ends(end)) {
      const char c = tokens_[end].text[0];
      end = c == '(' || c == '[' ? closing(tokens_, end) + 1 : end + 1;
    }
    if (end >= tokens_.size() || place_before(end, i + 2) != i + 2) return;
    replace(i, 2, "");
    insert(tokens_[i + 2].at, before_place());
    insert(tokens_[end].at, after_place(op) + "1" + after_value());
    last_handled_ = end;
  }

  /// Rest of a condition: the value is of a signed type, and 16 bits do not hold it.
  static std::string overflows() {
    return "&&(__typeof__(kt_v))-1<0&&((long long)kt_v>32767||(long long)kt_v<-32768))";
  }
  static std::string before_place() { return "({__auto_type kt_p=&("; }
  static std::string after_place(char op) { return std::string(");__auto_type kt_v=*kt_p") + op + "("; }
  static std::string after_value() {
    return ");if(_Generic(*kt_p,short:1,default:0)" + overflows() + "kilotwin_overflow();*kt_p=kt_v;})";
  }

  /// Rewrites PLACE op= VALUE. `value`: its first token, or kNowhere for 1; the operator has `octets` tokens at `i`.
  void change(std::size_t first, std::size_t i, char op, std::size_t value, std::size_t end, std::size_t octets) {
    if (end >= tokens_.size()) return;
    insert(tokens_[first].at, before_place());
    replace(i, octets, after_place(op) + (value == kNowhere ? "1" : ""));
    insert(tokens_[end].at, after_value());
    last_handled_ = end;
  }

  /// Surrounds a value by a test that acts if `is_narrow` holds.
  void test_value(std::size_t first, std::size_t end, const std::string& is_narrow) {
    if (end >= tokens_.size()) return;
    insert(tokens_[first].at, "({__auto_type kt_v=(");
    insert(tokens_[end].at, ");if(" + is_narrow + overflows() + "kilotwin_overflow();kt_v;})");
    last_handled_ = end;
  }

  /// Index of the `;`, `,` or `)` that ends the expression from token `i` on.
  [[nodiscard]] std::size_t end_of_value(std::size_t i) const {
    while (i < tokens_.size()) {
      const char c = tokens_[i].text[0];
      if (c == ';' || c == ',' || c == ')' || c == '}') return i;
      i = c == '(' || c == '[' || c == '{' ? closing(tokens_, i) + 1 : i + 1;
    }
    return tokens_.size();
  }

  /// Whether tokens [first, end) hold a sum, a difference, a product or a shift.
  [[nodiscard]] bool computes(std::size_t first, std::size_t end) const {
    for (std::size_t i = first + 1; i < std::min(end, tokens_.size()); ++i) {
      const char c = tokens_[i].text[0], before = tokens_[i - 1].text[0];
      if (c == '?' || c == '{' || (c == '=' && !is(i + 1, "=") && is_word(before))) return false;
      if ((c == '+' || c == '-' || c == '*') && (is_word(before) || before == ')' || before == ']') &&
          !(c == '-' && is_joined(i) && is(i + 1, ">")))
        return true;
    }
    return false;
  }

  /// First token of the variable, element or member that ends before token `end` and begins a statement, or kNowhere.
  [[nodiscard]] std::size_t place_before(std::size_t end, std::size_t from = kNowhere) const {
    std::size_t i = end;
    for (;;) {
      if (i == 0) return kNowhere;
      const std::string_view word = tokens_[i - 1].text;
      if (word == "]") {
        i = opening(i - 1);
        continue;
      }
      if (word == ")") {
        i = opening(i - 1);
        if (i == 0 || is_word(tokens_[i - 1].text[0])) return kNowhere;
        break;
      }
      if (!is_identifier(word)) return kNowhere;
      --i;
      if (i >= 1 && is(i - 1, "."))
        --i;
      else if (i >= 2 && is(i - 1, ">") && is(i - 2, "-") && is_joined(i - 2))
        i -= 2;
      else
        break;
    }
    while (i > 0 && is(i - 1, "*")) --i;
    return i == from || is_boundary(i) ? i : kNowhere;
  }

  /// Whether a statement, or a part of a for(), may begin at token `i`.
  [[nodiscard]] bool is_boundary(std::size_t i) const {
    if (i == 0) return true;
    const std::string_view before = tokens_[i - 1].text;
    if (before == ";" || before == "{" || before == "}" || before == "else" || before == "do") return true;
    if (before != ")") return false;
    const std::size_t open = opening(i - 1);
    static constexpr std::array<std::string_view, 4> kHeads{"if", "while", "for", "switch"};
    return open > 0 && is_one_of(tokens_[open - 1].text, kHeads);
  }

  /// Index of the bracket that the one at `close` closes, or 0.
  [[nodiscard]] std::size_t opening(std::size_t close) const {
    int depth = 0;
    for (std::size_t i = close + 1; i-- > 0;) {
      const char c = tokens_[i].text[0];
      if (c == ')' || c == ']' || c == '}') ++depth;
      if ((c == '(' || c == '[' || c == '{') && --depth == 0) return i;
    }
    return 0;
  }

  [[nodiscard]] std::string text_of(std::size_t first, std::size_t end) const {
    const Token& last = tokens_[end - 1];
    return std::string(text_.substr(tokens_[first].at, last.at + last.text.size() - tokens_[first].at));
  }

  std::string edited() {
    std::stable_sort(edits_.begin(), edits_.end(), [](const Edit& a, const Edit& b) { return a.at < b.at; });
    std::string result;
    std::size_t from = 0;
    for (const Edit& edit : edits_) {
      result.append(text_.substr(from, edit.at - from)).append(edit.text);
      from = edit.at + edit.removed;
    }
    return result.append(text_.substr(from));
  }

  std::string_view text_;
  std::vector<Token> tokens_;
  std::map<std::size_t, bool> parts_;
  std::vector<Edit> edits_;
  std::size_t last_handled_ = 0;  ///< stores do not begin before this token: they are part of the last one
};

}  // namespace

std::string with_robot_int(std::string_view preprocessed) { return Narrower(preprocessed).narrowed(); }

bool allows_robot_int(std::string_view preprocessed) {
  // The prototypes are in headers of the runtime, so calls are what follows another line marker.
  static constexpr std::array<std::string_view, 6> kTakers{"frexp",  "frexpf", "scanf",
                                                           "sscanf", "fscanf", "remquo"};
  const auto parts = system_parts(preprocessed);
  for (const Token& token : tokens_of(preprocessed)) {
    if (is_one_of(token.text, kTakers) && !std::prev(parts.upper_bound(token.at))->second) return false;
  }
  return true;
}

}  // namespace kilotwin::behaviours
