/// CsvReader: the rows of a table as text (RFC 4180), plain or gzipped.
///
/// Rows end in LF or CR LF; a byte order mark is skipped; blank lines are skipped. Cells are separated by commas, or by tabs
/// where the header holds a tab and no comma outside of quotes. A cell in double quotes may hold separators, line ends and, doubled, quotes; blanks around
/// other cells are dropped. Every error is a UserError "FILE:LINE:COLUMN: what is wrong; what would be right"; LINE and COLUMN count
/// from 1, COLUMN in octets.
///
/// It is not based on libcsv 3.0.3: that library is as fast, but it reports cells without their place in the file, which
/// every error must name.
#pragma once

#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace kilotwin {

struct CsvLayout {
  /// '\0': comma or tab, by the header. ' ': runs of blanks and tabs.
  char separator = '\0';
  bool header = true;      ///< the first row names the columns
  bool same_width = true;  ///< every row has as many cells as the first
};

class CsvReader {
 public:
  /// Reads the whole file. Throws UserError where it cannot be read, or has no header where the layout demands one.
  explicit CsvReader(const std::filesystem::path& file, const CsvLayout& layout = {});
  /// Of `content`, plain or gzipped; `name` stands for the file in errors.
  CsvReader(std::string name, std::string content, const CsvLayout& layout = {});

  /// The names of the columns; empty without a header.
  [[nodiscard]] const std::vector<std::string>& columns() const { return names_; }
  [[nodiscard]] std::optional<std::size_t> find_column(std::string_view name) const;
  /// The index of a column. Throws UserError where there is none of that name.
  [[nodiscard]] std::size_t column(std::string_view name) const;
  /// Throws UserError that names all of `needed` which are missing, the columns that are there, and `expected`.
  void require(std::initializer_list<std::string_view> needed, std::string_view expected) const;

  /// Goes to the next row; false at the end.
  bool next();
  [[nodiscard]] std::size_t cells() const { return cells_.size(); }
  /// Valid until next().
  [[nodiscard]] std::string_view text(std::size_t column) const { return cells_[column].text; }
  /// A finite number.
  [[nodiscard]] double number(std::size_t column) const;
  /// NaN where the cell is empty or says nan or NA.
  [[nodiscard]] double number_or_nan(std::size_t column) const;
  /// A whole number, 0..2^32-1.
  [[nodiscard]] std::uint32_t whole(std::size_t column) const;
  /// Whether the row is the last of the file and has no line end, as where the writer was killed.
  [[nodiscard]] bool cut_off() const { return at_ >= content_.size() && !content_.ends_with('\n'); }
  /// The line at which the row begins.
  [[nodiscard]] std::size_t line() const { return row_line_; }
  /// Throws a UserError about a cell of the row; behind the last cell: about the row's end.
  [[noreturn]] void complain(std::size_t column, std::string_view what) const;

 private:
  struct Cell {
    std::string_view text;
    std::size_t at;  // offset in content_
  };
  void begin();
  bool read_row();
  void read_plain_row(std::size_t end);
  void read_quoted_row();
  std::size_t read_quoted_cell(std::size_t at);
  [[nodiscard]] bool separates(char c) const { return c == separator_ || (separator_ == ' ' && c == '\t'); }
  [[nodiscard]] std::string name_of(std::size_t column) const;
  [[noreturn]] void complain_at(std::size_t offset, std::string_view what) const;

  std::string file_, content_;
  CsvLayout layout_;
  char separator_ = ',';
  std::size_t at_ = 0;                     // offset of the next row
  std::size_t next_line_ = 1;              // its number
  std::size_t row_at_ = 0, row_line_ = 0;  // of the row at hand
  std::size_t row_end_ = 0;
  std::size_t width_ = 0;  // cells of the first row
  std::vector<std::string> names_;
  std::vector<Cell> cells_;
  std::vector<std::string> unquoted_;  // texts of the row's cells that held doubled quotes
};

}  // namespace kilotwin
