#include "clients/recorder/expression.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>

#include "core/base/error.hpp"
#include "core/math/elementary.h"
#include "core/stats/quantiles.hpp"

namespace kilotwin::recorder {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr int kDeepest = 60;

enum class Operation : std::uint8_t {
  kNumber,
  kName,
  kNegate,
  kNot,
  kSqrt,
  kAbs,
  kSin,
  kCos,
  kAdd,
  kSubtract,
  kMultiply,
  kDivide,
  kPower,
  kEqual,
  kUnequal,
  kLess,
  kLessEqual,
  kGreater,
  kGreaterEqual,
  kAnd,
  kOr,
  kMean,
  kSum,
  kMin,
  kMax,
  kSd,
  kMedian,
  kShare,
  kCount,
  kQuantile
};

struct Function {
  std::string_view name;
  Operation operation;
  std::size_t arguments;  ///< without the condition
};
constexpr std::array<Function, 13> kFunctions{{{"mean", Operation::kMean, 1},
                                               {"sum", Operation::kSum, 1},
                                               {"min", Operation::kMin, 1},
                                               {"max", Operation::kMax, 1},
                                               {"sd", Operation::kSd, 1},
                                               {"median", Operation::kMedian, 1},
                                               {"share", Operation::kShare, 1},
                                               {"count", Operation::kCount, 1},
                                               {"quantile", Operation::kQuantile, 2},
                                               {"sqrt", Operation::kSqrt, 1},
                                               {"abs", Operation::kAbs, 1},
                                               {"sin", Operation::kSin, 1},
                                               {"cos", Operation::kCos, 1}}};

bool is_reduction(Operation operation) { return operation >= Operation::kMean; }

bool begins_name(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

}  // namespace

struct Expression::Node {
  Operation operation = Operation::kNumber;
  double number = 0;
  std::string name;
  std::vector<std::unique_ptr<Node>> arguments;
  bool single = true;  ///< one number, not one per robot
};

namespace {

using Node = Expression::Node;
using NodePtr = std::unique_ptr<Node>;

class Parser {
 public:
  Parser(std::string_view text, const KindOfName& kind_of) : text_(text), kind_of_(kind_of) {}

  NodePtr parse(std::vector<std::string>& names) {
    if (text_.size() > Expression::kLongest)
      throw UserError(fmt::format("an expression has at most {} characters", Expression::kLongest));
    NodePtr root = disjunction();
    skip_blanks();
    if (at_ != text_.size()) refuse("something is left over");
    if (!root->single) {
      at_ = 0;
      refuse("this is one value per robot; reduce it to one number, such as mean(...) or share(...)");
    }
    names = std::move(names_);
    return root;
  }

 private:
  [[noreturn]] void refuse(const std::string& what) const {
    throw UserError(fmt::format("\"{}\", character {}: {}", text_, at_ + 1, what));
  }

  void skip_blanks() {
    while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\t' || text_[at_] == '\n')) ++at_;
  }

  bool take(std::string_view token) {
    skip_blanks();
    if (!text_.substr(at_).starts_with(token)) return false;
    const std::size_t end = at_ + token.size();
    if (begins_name(token[0]) && end < text_.size() && (begins_name(text_[end]) || is_digit(text_[end])))
      return false;
    at_ = end;
    return true;
  }

  struct Depth {
    explicit Depth(Parser& parser) : parser_(parser) {
      if (++parser_.depth_ > kDeepest) parser_.refuse("the expression is nested too deeply");
    }
    ~Depth() { --parser_.depth_; }
    Depth(const Depth&) = delete;
    Parser& parser_;
  };

  static NodePtr node(Operation operation, NodePtr a, NodePtr b = nullptr) {
    auto made = std::make_unique<Node>();
    made->operation = operation;
    made->single = a->single && (!b || b->single);
    made->arguments.push_back(std::move(a));
    if (b) made->arguments.push_back(std::move(b));
    return made;
  }

  NodePtr disjunction() {
    const Depth depth(*this);
    NodePtr left = conjunction();
    while (take("or")) left = limited(node(Operation::kOr, std::move(left), conjunction()));
    return left;
  }
  NodePtr conjunction() {
    NodePtr left = negation();
    while (take("and")) left = limited(node(Operation::kAnd, std::move(left), negation()));
    return left;
  }
  NodePtr negation() {
    const Depth depth(*this);
    if (take("not")) return node(Operation::kNot, negation());
    return comparison();
  }

  NodePtr comparison() {
    constexpr std::array<std::pair<std::string_view, Operation>, 6> kOperators{{{"==", Operation::kEqual},
                                                                                {"!=", Operation::kUnequal},
                                                                                {"<=", Operation::kLessEqual},
                                                                                {">=", Operation::kGreaterEqual},
                                                                                {"<", Operation::kLess},
                                                                                {">", Operation::kGreater}}};
    NodePtr left = sum();
    for (const auto& [token, operation] : kOperators) {
      if (take(token)) return node(operation, std::move(left), sum());
    }
    return left;
  }

  NodePtr sum() {
    NodePtr left = product();
    for (;;) {
      if (take("+"))
        left = limited(node(Operation::kAdd, std::move(left), product()));
      else if (take("-"))
        left = limited(node(Operation::kSubtract, std::move(left), product()));
      else
        return left;
    }
  }

  NodePtr product() {
    NodePtr left = power();
    for (;;) {
      if (take("*"))
        left = limited(node(Operation::kMultiply, std::move(left), power()));
      else if (take("/"))
        left = limited(node(Operation::kDivide, std::move(left), power()));
      else
        return left;
    }
  }

  NodePtr power() {
    const Depth depth(*this);
    if (take("-")) return node(Operation::kNegate, power());
    NodePtr base = primary();
    if (take("^")) return node(Operation::kPower, std::move(base), power());
    return base;
  }

  NodePtr primary() {
    skip_blanks();
    if (take("(")) {
      NodePtr inner = disjunction();
      if (!take(")")) refuse("expected )");
      return inner;
    }
    if (at_ < text_.size() && (is_digit(text_[at_]) || text_[at_] == '.')) return number();
    if (at_ < text_.size() && begins_name(text_[at_])) return name_or_call();
    refuse(at_ == text_.size() ? "the expression ends too early" : "expected a number, a name or (");
  }

  NodePtr number() {
    auto made = std::make_unique<Node>();
    const auto [end, error] = std::from_chars(text_.data() + at_, text_.data() + text_.size(), made->number);
    if (error != std::errc() || !std::isfinite(made->number)) refuse("expected a number");
    at_ = static_cast<std::size_t>(end - text_.data());
    return made;
  }

  std::string word() {
    const std::size_t begin = at_;
    while (at_ < text_.size() && (begins_name(text_[at_]) || is_digit(text_[at_]))) ++at_;
    return std::string(text_.substr(begin, at_ - begin));
  }

  /// Names of variables have fields and indices: loop::table[3].x, mydata->x.
  std::string name() {
    std::string name = word();
    const auto more = [&](std::string_view connector) {
      const std::string_view rest = text_.substr(at_);
      if (!rest.starts_with(connector) || rest.size() == connector.size() || !begins_name(rest[connector.size()]))
        return false;
      at_ += connector.size();
      name += std::string(connector) + word();
      return true;
    };
    for (;;) {
      if (more("::") || more(".") || more("->")) continue;
      std::size_t end = at_ + 1;
      if (at_ < text_.size() && text_[at_] == '[') {
        while (end < text_.size() && is_digit(text_[end])) ++end;
        if (end > at_ + 1 && end < text_.size() && text_[end] == ']') {
          name += text_.substr(at_, end + 1 - at_);
          at_ = end + 1;
          continue;
        }
      }
      return name;
    }
  }

  NodePtr name_or_call() {
    const std::size_t begin = at_;
    std::string name = this->name();
    if (take("(")) {
      const auto function =
          std::find_if(kFunctions.begin(), kFunctions.end(), [&](const Function& f) { return f.name == name; });
      if (function != kFunctions.end()) return call(*function);
      at_ = begin;
      std::string names;
      for (const Function& f : kFunctions) names += (names.empty() ? "" : ", ") + std::string(f.name);
      refuse(fmt::format("there is no function \"{}\"; there are {}", name, names));
    }
    const NameKind kind = kind_of_(name);
    if (kind == NameKind::kUnknown) {
      at_ = begin;
      refuse(fmt::format(
          "there is no \"{}\"; names are x_mm, y_mm, heading_rad, displacement_mm, led, state, group, failed, "
          "robot, time_s, colours, life cycles, and the variables that the run records",
          name));
    }
    if (std::find(names_.begin(), names_.end(), name) == names_.end()) names_.push_back(name);
    auto made = std::make_unique<Node>();
    made->operation = Operation::kName;
    made->name = std::move(name);
    made->single = kind == NameKind::kSingle;
    return made;
  }

  NodePtr call(const Function& function) {
    auto made = std::make_unique<Node>();
    made->operation = function.operation;
    do made->arguments.push_back(disjunction());
    while (take(","));
    if (!take(")")) refuse("expected , or )");
    const bool reduces = is_reduction(function.operation);
    const std::size_t given = made->arguments.size();
    if (given < function.arguments || given > function.arguments + (reduces ? 1 : 0)) {
      refuse(fmt::format("{} takes {} argument{}{}", function.name, function.arguments,
                         function.arguments == 1 ? "" : "s", reduces ? ", and a condition" : ""));
    }
    if (function.operation == Operation::kQuantile && !made->arguments[1]->single)
      refuse("the second argument of quantile is one number, 0 to 1");
    made->single = reduces || made->arguments[0]->single;
    return made;
  }

  /// Chains of operators nest to the left without recursion of the parser, but evaluation recurses.
  NodePtr limited(NodePtr node) {
    if (++operators_ > 200) refuse("the expression has too many operators");
    return node;
  }

  const std::string_view text_;
  const KindOfName& kind_of_;
  std::size_t at_ = 0;
  int depth_ = 0, operators_ = 0;
  std::vector<std::string> names_;
};

/// One number, or one per robot.
using Values = std::vector<double>;

double truth(bool value) { return value ? 1 : 0; }

double apply(Operation operation, double a) {
  switch (operation) {
    case Operation::kNegate: return -a;
    case Operation::kNot: return std::isnan(a) ? a : truth(a == 0);
    case Operation::kSqrt: return std::sqrt(a);
    case Operation::kAbs: return std::abs(a);
    default: break;
  }
  if (!(std::abs(a) < 1e9)) return kNone;
  double cosine = 0, sine = 0;
  kt_sincos(a, &sine, &cosine);
  return operation == Operation::kSin ? sine : cosine;
}

double apply(Operation operation, double a, double b) {
  if (std::isnan(a) || std::isnan(b)) return kNone;
  switch (operation) {
    case Operation::kAdd: return a + b;
    case Operation::kSubtract: return a - b;
    case Operation::kMultiply: return a * b;
    case Operation::kDivide: return a / b;
    case Operation::kPower: return std::pow(a, b);
    case Operation::kEqual: return truth(a == b);
    case Operation::kUnequal: return truth(a != b);
    case Operation::kLess: return truth(a < b);
    case Operation::kLessEqual: return truth(a <= b);
    case Operation::kGreater: return truth(a > b);
    case Operation::kGreaterEqual: return truth(a >= b);
    case Operation::kAnd: return truth(a != 0 && b != 0);
    default: return truth(a != 0 || b != 0);
  }
}

double mean_of(const Values& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

/// `values` has no NaN.
double reduce(Operation operation, Values& values, double q) {
  if (operation == Operation::kCount)
    return static_cast<double>(std::count_if(values.begin(), values.end(), [](double v) { return v != 0; }));
  if (operation == Operation::kSum)
    return values.empty() ? 0 : mean_of(values) * static_cast<double>(values.size());
  if (values.empty()) return kNone;
  switch (operation) {
    case Operation::kMean: return mean_of(values);
    case Operation::kMin: return *std::min_element(values.begin(), values.end());
    case Operation::kMax: return *std::max_element(values.begin(), values.end());
    case Operation::kShare:
      for (double& value : values) value = truth(value != 0);
      return mean_of(values);
    case Operation::kMedian: return stats::interpolated_quantile(values, 0.5);
    case Operation::kQuantile: return stats::interpolated_quantile(values, q);
    default: break;
  }
  const double mean = mean_of(values);
  double square = 0;
  for (const double value : values) square += (value - mean) * (value - mean);
  return values.size() < 2 ? kNone : std::sqrt(square / static_cast<double>(values.size() - 1));
}

class Evaluation {
 public:
  Evaluation(std::size_t robots, const NamedValues& values) : robots_(robots), values_(values) {}

  Values operator()(const Node& node) const {
    switch (node.operation) {
      case Operation::kNumber: return {node.number};
      case Operation::kName: return values_(node.name);
      default: break;
    }
    Values first = (*this)(*node.arguments[0]);
    if (is_reduction(node.operation)) return {reduced(node, std::move(first))};
    if (node.arguments.size() == 1) {
      for (double& value : first) value = apply(node.operation, value);
      return first;
    }
    const Values second = (*this)(*node.arguments[1]);
    if (first.size() < second.size()) first.resize(second.size(), first[0]);
    for (std::size_t i = 0; i < first.size(); ++i)
      first[i] = apply(node.operation, first[i], second[second.size() == 1 ? 0 : i]);
    return first;
  }

 private:
  double reduced(const Node& node, Values values) const {
    const bool is_quantile = node.operation == Operation::kQuantile;
    const double q = is_quantile ? (*this)(*node.arguments[1])[0] : 0;
    values.resize(robots_, values.size() == 1 ? values[0] : kNone);
    const std::size_t condition = is_quantile ? 2 : 1;
    if (node.arguments.size() > condition) {
      Values holds = (*this)(*node.arguments[condition]);
      holds.resize(robots_, holds[0]);
      for (std::size_t i = 0; i < robots_; ++i) {
        if (std::isnan(holds[i]) || holds[i] == 0) values[i] = kNone;
      }
    }
    std::erase_if(values, [](double value) { return std::isnan(value); });
    return reduce(node.operation, values, q);
  }

  const std::size_t robots_;
  const NamedValues& values_;
};

}  // namespace

Expression::Expression(std::unique_ptr<Node> root, std::vector<std::string> names)
    : root_(std::move(root)), names_(std::move(names)) {}
Expression::Expression(Expression&&) noexcept = default;
Expression& Expression::operator=(Expression&&) noexcept = default;
Expression::~Expression() = default;

Expression Expression::parse(std::string_view text, const KindOfName& kind_of) {
  std::vector<std::string> names;
  NodePtr root = Parser(text, kind_of).parse(names);
  return {std::move(root), std::move(names)};
}

double Expression::value(std::size_t robots, const NamedValues& values) const {
  return Evaluation(robots, values)(*root_)[0];
}

}  // namespace kilotwin::recorder
