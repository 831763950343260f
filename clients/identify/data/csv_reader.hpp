/// Rows of a CSV file, plain or gzipped, with a header; errors name file, line and column.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace kilotwin::identify {

class CsvReader {
 public:
  /// Reads the whole file. Throws UserError where it cannot be read or is empty.
  explicit CsvReader(std::filesystem::path file);

  /// The place of a column; throws UserError where there is none of that name.
  [[nodiscard]] std::size_t column(std::string_view name) const;
  [[nodiscard]] std::optional<std::size_t> find_column(std::string_view name) const;

  /// Goes to the next row that is not blank; false at the end. Throws UserError where it has not as many cells as the header.
  bool next();
  [[nodiscard]] std::string_view text(std::size_t column) const { return cells_[column]; }
  /// A finite number.
  [[nodiscard]] double number(std::size_t column) const;
  /// NaN where the cell is empty or says nan.
  [[nodiscard]] double number_or_nan(std::size_t column) const;
  /// A whole number, 0..2^32-1.
  [[nodiscard]] std::uint32_t whole(std::size_t column) const;
  /// Throws a UserError about a cell of the row at hand.
  [[noreturn]] void complain(std::size_t column, const std::string& what) const;

 private:
  [[nodiscard]] std::string_view line();
  void split(std::string_view line);

  std::filesystem::path file_;
  std::string content_;
  std::size_t at_ = 0, line_ = 0;
  const char* line_start_ = nullptr;
  std::vector<std::string> names_;
  std::vector<std::string_view> cells_;
};

}  // namespace kilotwin::identify
