#include "services/behaviours/variable_path.hpp"

#include <fmt/format.h>

#include <charconv>

#include "core/base/error.hpp"

namespace kilotwin::behaviours {
namespace {

bool begins_name(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }

class Parser {
 public:
  explicit Parser(std::string_view text) : text_(text), rest_(text) {}

  VariablePath parse() {
    if (text_.size() > VariablePath::kLongest)
      throw UserError(fmt::format("a variable's name has at most {} characters", VariablePath::kLongest));
    VariablePath path;
    path.name = name();
    if (take("::")) {
      path.function = std::move(path.name);
      path.name = name();
    }
    while (!rest_.empty()) path.steps.push_back(step());
    return path;
  }

 private:
  using Step = VariablePath::Step;

  bool take(std::string_view token) {
    if (!rest_.starts_with(token)) return false;
    rest_.remove_prefix(token.size());
    return true;
  }

  std::string name() {
    std::size_t length = 0;
    while (length < rest_.size() &&
           (begins_name(rest_[length]) || (length > 0 && rest_[length] >= '0' && rest_[length] <= '9')))
      ++length;
    if (length == 0) refuse("a name is missing");
    std::string name(rest_.substr(0, length));
    rest_.remove_prefix(length);
    return name;
  }

  Step step() {
    if (take(".")) return {Step::Kind::kField, name(), 0};
    if (take("->")) return {Step::Kind::kArrow, name(), 0};
    if (!take("[")) refuse("expected ., -> or [");
    Step step{Step::Kind::kIndex, {}, 0};
    const auto [end, error] = std::from_chars(rest_.data(), rest_.data() + rest_.size(), step.index);
    if (error != std::errc() || step.index > 0xffffff) refuse("expected an index, a whole number");
    rest_.remove_prefix(static_cast<std::size_t>(end - rest_.data()));
    if (!take("]")) refuse("expected ]");
    return step;
  }

  [[noreturn]] void refuse(std::string_view what) const {
    throw UserError(
        fmt::format("\"{}\", character {}: {}; write a variable as hops, state.mode, table[3], mydata->x "
                    "or loop::count",
                    text_, text_.size() - rest_.size() + 1, what));
  }

  const std::string_view text_;
  std::string_view rest_;
};

}  // namespace

VariablePath VariablePath::parse(std::string_view text) { return Parser(text).parse(); }

}  // namespace kilotwin::behaviours
