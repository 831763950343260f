/// Expression: the value of an observable, such as `share(led == red)` or `quantile(hops, 0.9, group == 1)`.
///
///   expression  := comparisons joined by `and`, `or`; `not` before one
///   comparison  := sum [ == != < <= > >= sum ]
///   sum         := products joined by + -
///   product     := powers joined by * /
///   power       := [ - ] primary [ ^ power ]
///   primary     := number | name | ( expression ) | function ( expression, ... )
///
/// A name stands for one value per robot. A reduction makes one number of them: mean, sum, min, max, sd, median, share, count, and
/// quantile(x, q). Each takes a condition as a last argument, and then regards those robots alone. sqrt, abs, sin and cos work on each
/// value. A robot without a value, as of a variable that its program does not have, counts nowhere. The whole expression must give one
/// number.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace kilotwin::recorder {

enum class NameKind : std::uint8_t { kUnknown, kPerRobot, kSingle };
/// Returns the kind of value that a name stands for.
using KindOfName = std::function<NameKind(const std::string& name)>;
/// The values that names stand for: one per robot, or a single one. NaN: none.
using NamedValues = std::function<const std::vector<double>&(const std::string& name)>;

class Expression {
 public:
  static constexpr std::size_t kLongest = 1000;

  /// Throws UserError: `character N: what is wrong`, without a place.
  static Expression parse(std::string_view text, const KindOfName& kind_of);
  Expression(Expression&&) noexcept;
  Expression& operator=(Expression&&) noexcept;
  ~Expression();

  /// The names that it uses, each once.
  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }
  /// `robots`: length of the values of names that are not single, at least 1. NaN where no robot counts.
  [[nodiscard]] double value(std::size_t robots, const NamedValues& values) const;

  struct Node;

 private:
  Expression(std::unique_ptr<Node> root, std::vector<std::string> names);
  std::unique_ptr<Node> root_;
  std::vector<std::string> names_;
};

}  // namespace kilotwin::recorder
