/// Columns of an Arrow IPC file, which is also called Feather, version 2: https://arrow.apache.org/docs/format/Columnar.html.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace kilotwin::importers {

struct ArrowColumn {
  bool is_text = false;
  std::vector<double> numbers;     ///< of a column of numbers; a missing one is NaN
  std::vector<std::string> texts;  ///< of a column of texts; a missing one is empty
};

struct ArrowFile {
  std::map<std::string, ArrowColumn> columns;
  std::map<std::string, std::string> metadata;
  std::size_t rows = 0;
};

/// Reads the columns that are whole numbers, floating-point numbers or texts; others are left out. Throws UserError if it is no such
/// file, is damaged, or is compressed.
[[nodiscard]] ArrowFile read_arrow(const std::filesystem::path& file);

}  // namespace kilotwin::importers
