/// Pieces of the report's page.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace kilotwin::identify::html {

/// Text without markup; what is no UTF-8 is replaced.
[[nodiscard]] std::string escaped(std::string_view text);

/// "bias_sd_mm_s" as "bias sd, mm/s".
[[nodiscard]] std::string with_unit(std::string_view name);

/// What stands for a plot until it is drawn. No text that was escaped holds it.
[[nodiscard]] std::string mark_of(std::size_t plot);
/// A picture within the page itself.
[[nodiscard]] std::string image(std::string_view svg, std::string_view alt);

class Table {
 public:
  explicit Table(std::vector<std::string> heads) : heads_(std::move(heads)) {}
  /// Cells are markup, one per head.
  void row(const std::vector<std::string>& cells);
  [[nodiscard]] std::string text(std::string_view kind = "") const;

 private:
  std::vector<std::string> heads_;
  std::string rows_;
};

/// The whole document around `body`, with its style.
[[nodiscard]] std::string page(std::string_view title, std::string_view body);

}  // namespace kilotwin::identify::html
