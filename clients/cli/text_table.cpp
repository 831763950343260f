#include "clients/cli/text_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>

namespace kilotwin::cli {

std::string with_error(const stats::Moments& sample) {
  if (sample.count() == 0) return "-";
  if (sample.count() == 1) return fmt::format("{:.5g}", sample.mean());
  return fmt::format("{:.5g} ±{:.2g}", sample.mean(), sample.standard_error());
}

std::string aligned(const std::vector<std::vector<std::string>>& rows) {
  const auto width_of = [](const std::string& cell) {
    return static_cast<std::size_t>(std::count_if(
        cell.begin(), cell.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xc0) != 0x80; }));
  };
  std::vector<std::size_t> width(rows[0].size(), 0);
  for (const auto& row : rows) {
    for (std::size_t i = 0; i < row.size(); ++i) width[i] = std::max(width[i], width_of(row[i]));
  }
  std::string text;
  for (const auto& row : rows) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      const std::string padding(width[i] - width_of(row[i]), ' ');
      text += i == 0 ? row[i] + padding : "   " + padding + row[i];
    }
    text += '\n';
  }
  return text;
}

}  // namespace kilotwin::cli
