/// CsvReader: the rows of a table as text (RFC 4180), plain or gzipped.
///
/// Rows end in LF or CR LF. The reader skips a byte order mark and blank lines. The separator is the comma; it is the tab if
/// the header has a tab and no comma outside quotes. A cell in double quotes may contain separators, line ends and doubled
/// quotes. Blanks around other cells are dropped. Every error is a UserError "FILE:LINE:COLUMN: what is wrong; what would
/// be right". LINE and COLUMN count from 1, COLUMN in octets.
///
/// The reader is not based on libcsv 3.0.3: that library is as fast, but reports cells without their position in the file,
/// which every error must name.
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
  /// '\0': comma or tab, chosen by the header. ' ': runs of blanks and tabs.
  char separator = '\0';
  bool header = true;      ///< the first row has the names of the columns
  bool same_width = true;  ///< every row must have as many cells as the first
};

class CsvReader {
 public:
  /// Reads the whole file. Throws UserError if it cannot be read, or lacks a header that the layout requires.
  explicit CsvReader(const std::filesystem::path& file, const CsvLayout& layout = {});
  /// Reads `content`, plain or gzipped; `name` stands for the file in errors.
  CsvReader(std::string name, std::string content, const CsvLayout& layout = {});

  /// The names of the columns; empty without a header.
  [[nodiscard]] const std::vector<std::string>& columns() const { return names_; }
  [[nodiscard]] std::optional<std::size_t> find_column(std::string_view name) const;
  /// The index of a column. Throws UserError if no column has that name.
  [[nodiscard]] std::size_t column(std::string_view name) const;
  /// Throws UserError if columns of `needed` are missing; the line names them, the existing columns, and `expected`.
  void require(std::initializer_list<std::string_view> needed, std::string_view expected) const;

  /// Advances to the next row; false at the end.
  bool next();
  [[nodiscard]] std::size_t cells() const { return cells_.size(); }
  /// Valid until next().
  [[nodiscard]] std::string_view text(std::size_t column) const { return cells_[column].text; }
  /// A finite number. Throws UserError otherwise.
  [[nodiscard]] double number(std::size_t column) const;
  /// As number(); NaN if the cell is empty, "nan" or "NA".
  [[nodiscard]] double number_or_nan(std::size_t column) const;
  /// An integer in 0..2^32-1. Throws UserError otherwise.
  [[nodiscard]] std::uint32_t whole(std::size_t column) const;
  /// Whether the row is the last of the file and lacks a line end, as after a killed writer.
  [[nodiscard]] bool cut_off() const { return at_ >= content_.size() && !content_.ends_with('\n'); }
  /// Number of the line at which the row begins.
  [[nodiscard]] std::size_t line() const { return row_line_; }
  /// Throws a UserError about a cell of the row. An index behind the last cell refers to the row's end.
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
  std::size_t next_line_ = 1;              // its line number
  std::size_t row_at_ = 0, row_line_ = 0;  // offset and line number of the current row
  std::size_t row_end_ = 0;
  std::size_t width_ = 0;  // number of cells of the first row
  std::vector<std::string> names_;
  std::vector<Cell> cells_;
  std::vector<std::string> unquoted_;  // texts of the row's cells with doubled quotes
};

}  // namespace kilotwin
