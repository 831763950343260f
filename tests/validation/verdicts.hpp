/// The table that a validation prints: what was measured, what was expected, how far apart they may be, and the verdict.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace kilotwin::validation {

/// A mean and its standard error; 0 where a figure is exact.
struct Figure {
  double value = 0;
  double error = 0;
};

class Verdicts {
 public:
  /// A heading for the rows that follow.
  void section(const std::string& title);
  /// Whether the measured figure is within `tolerance` of the expected one. `unit` may be empty.
  void near(const std::string& what, const std::string& unit, Figure measured, Figure expected, double tolerance);
  /// Within `errors` standard errors of the two together.
  void near_in_errors(const std::string& what, const std::string& unit, Figure measured, Figure expected,
                      double errors);
  /// Within `part` of the expected figure, and `errors` standard errors more.
  void near_in_parts(const std::string& what, const std::string& unit, Figure measured, Figure expected,
                     double part, double errors);
  void at_most(const std::string& what, const std::string& unit, Figure measured, double bound);
  void at_least(const std::string& what, const std::string& unit, Figure measured, double bound);
  /// A check that could not be made, and why. No miss.
  void absent(const std::string& what, const std::string& why);

  /// All sections and rows so far as Markdown tables.
  [[nodiscard]] const std::string& markdown() const { return markdown_; }
  [[nodiscard]] std::size_t misses() const { return misses_; }
  [[nodiscard]] std::size_t rows() const { return rows_; }

 private:
  void row(const std::string& what, const std::string& unit, Figure measured, const std::string& expected,
           const std::string& tolerance, bool good);

  std::size_t misses_ = 0, rows_ = 0;
  std::string markdown_;
};

}  // namespace kilotwin::validation
