/// HTML elements of the report.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <kainjow/mustache.hpp>

namespace kilotwin::html {

/// Escaped text. Invalid UTF-8 is replaced.
[[nodiscard]] std::string escaped(std::string_view text);

/// "bias_sd_mm_s" as "bias sd, mm/s".
[[nodiscard]] std::string with_unit(std::string_view name);

/// Placeholder of a plot until it is drawn. Escaped text cannot contain it.
[[nodiscard]] std::string mark_of(std::size_t plot);
/// The ground behind an image. Plots are transparent: a dark page inverts their ink. Pictures bring a light ground.
enum class Ground { kPage, kOwn };
/// An inline image.
[[nodiscard]] std::string image(std::string_view svg, std::string_view alt, Ground ground = Ground::kPage);

/// Values for the names of a template.
using Data = kainjow::mustache::data;

/// Fills a mustache template. {{names}} are escaped, {{{names}}} are markup.
[[nodiscard]] std::string rendered(std::string_view text, const Data& data);

class Table {
 public:
  explicit Table(std::vector<std::string> heads) : heads_(std::move(heads)) {}
  /// Cells are markup, one per column.
  void row(const std::vector<std::string>& cells);
  [[nodiscard]] std::string text(std::string_view kind = "") const;

 private:
  std::vector<std::string> heads_;
  std::vector<Data> rows_;
};

struct Bar {
  std::string what;
  std::string kind;   ///< its colour: "before", "after" or "floor"
  double length = 0;  ///< from 0
  std::string value;
  std::string interval = {};  ///< of the value; empty: none
};
/// Horizontal bars. `longest`: the length that fills the width; without a positive one there are no bars.
[[nodiscard]] std::string bars(const std::vector<Bar>& bars, double longest);

/// The whole document around `body`, with its style sheet.
[[nodiscard]] std::string page(std::string_view title, std::string_view body);

}  // namespace kilotwin::html
