#include "tests/validation/verdicts.hpp"

#include <fmt/format.h>

#include <cctype>
#include <cmath>
#include <cstdio>

namespace kilotwin::validation {
namespace {

std::string text_of(Figure figure) {
  if (figure.error == 0) return fmt::format("{:.5g}", figure.value);
  return fmt::format("{:.5g} +-{:.2g}", figure.value, figure.error);
}

double together(Figure a, Figure b) { return std::sqrt(a.error * a.error + b.error * b.error); }

}  // namespace

void Verdicts::section(const std::string& title) {
  fmt::print("\n{}\n{:<58} {:>20} {:>20} {:>18}  verdict\n", title, "", "measured", "expected", "tolerance");
  std::fflush(stdout);
  std::string heading = title;
  heading[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(heading[0])));
  markdown_ += fmt::format(
      "\n## {}\n\n| figure | measured | expected | tolerance | verdict |\n|---|---|---|---|---|\n", heading);
}

void Verdicts::row(const std::string& what, const std::string& unit, Figure measured, const std::string& expected,
                   const std::string& tolerance, bool good) {
  ++rows_;
  if (!good) ++misses_;
  fmt::print("  {:<56} {:>20} {:>20} {:>18}  {}\n", unit.empty() ? what : what + ", " + unit, text_of(measured),
             expected, tolerance, good ? "good" : "MISS");
  std::fflush(stdout);
  markdown_ += fmt::format("| {} | {} | {} | {} | {} |\n", unit.empty() ? what : what + ", " + unit,
                           text_of(measured), expected, tolerance, good ? "good" : "MISS");
}

void Verdicts::near(const std::string& what, const std::string& unit, Figure measured, Figure expected,
                    double tolerance) {
  row(what, unit, measured, text_of(expected), fmt::format("{:.3g}", tolerance),
      std::abs(measured.value - expected.value) <= tolerance);
}

void Verdicts::near_in_errors(const std::string& what, const std::string& unit, Figure measured, Figure expected,
                              double errors) {
  const double tolerance = errors * together(measured, expected);
  row(what, unit, measured, text_of(expected), fmt::format("{:.3g} ({:g} s.e.)", tolerance, errors),
      std::abs(measured.value - expected.value) <= tolerance);
}

void Verdicts::near_in_parts(const std::string& what, const std::string& unit, Figure measured, Figure expected,
                             double part, double errors) {
  const double tolerance = part * std::abs(expected.value) + errors * together(measured, expected);
  const std::string text = errors > 0 ? fmt::format("{:g} % + {:g} s.e.", 100 * part, errors)
                                      : fmt::format("{:.3g} ({:g} %)", tolerance, 100 * part);
  row(what, unit, measured, text_of(expected), text, std::abs(measured.value - expected.value) <= tolerance);
}

void Verdicts::at_most(const std::string& what, const std::string& unit, Figure measured, double bound) {
  row(what, unit, measured, fmt::format("<= {:.5g}", bound), "", measured.value <= bound);
}

void Verdicts::at_least(const std::string& what, const std::string& unit, Figure measured, double bound) {
  row(what, unit, measured, fmt::format(">= {:.5g}", bound), "", measured.value >= bound);
}

void Verdicts::absent(const std::string& what, const std::string& why) {
  fmt::print("  {:<56} not looked at: {}\n", what, why);
  std::fflush(stdout);
}

}  // namespace kilotwin::validation
