/// Table: rows of typed columns, written to CSV (.csv, .csv.gz, - for standard output), NumPy (.npz) or Arrow (.arrow,
/// .feather).
///
/// A row is written cell by cell, in the order of the columns:
///
///   const auto table = open_table("poses.npz", {{"time_s", "s", CellType::kNumber}, {"robot", "", CellType::kInteger}}, about);
///   table->number(0.5); table->integer(3); table->end_row();
///   table->close();
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/time.hpp"

namespace kilotwin::recorder {

enum class CellType : std::uint8_t {
  kInteger,  ///< int64; in NumPy float64 where a cell is missing
  kNumber,   ///< float64; a missing cell is NaN in NumPy
  kTime,     ///< float64, s; in CSV all digits of the tick's time
  kText      ///< Unicode strings; a missing cell is empty in NumPy
};

struct Column {
  std::string name;
  std::string unit;  ///< empty: a pure number or text
  CellType type = CellType::kNumber;
  int decimals = -1;  ///< in CSV, with kNumber; -1: the shortest text that gives the same number
};

/// Data that is written beside the rows: name and value. In .npz as JSON in the archive's comment, in .arrow in
/// the schema's metadata, beside a CSV file as FILE.json.
using TableMetadata = std::vector<std::pair<std::string, std::string>>;

class Table {
 public:
  explicit Table(std::size_t columns) : columns_(columns) {}
  virtual ~Table() = default;
  Table(const Table&) = delete;
  Table& operator=(const Table&) = delete;

  virtual void integer(std::int64_t value) = 0;
  virtual void number(double value) = 0;
  virtual void time(Tick tick, TickLength length) = 0;
  virtual void text(std::string_view value) = 0;
  virtual void missing() = 0;
  /// Throws RunError if the table cannot be written.
  virtual void end_row() = 0;
  /// Writes the rest. Without this call the file is incomplete. Throws RunError.
  virtual void close() = 0;
  [[nodiscard]] std::uint64_t rows() const { return rows_; }
  [[nodiscard]] std::size_t columns() const { return columns_; }

 protected:
  const std::size_t columns_;
  std::uint64_t rows_ = 0;
};

/// Creates or replaces the file. Its ending chooses the format; one that says nothing means CSV. Throws UserError for the ending of
/// another format, RunError if the file cannot be written.
[[nodiscard]] std::unique_ptr<Table> open_table(const std::filesystem::path& file, std::vector<Column> columns,
                                                const TableMetadata& metadata);

/// A column as JSON in one line: {"name", "unit", "type"}.
[[nodiscard]] std::string column_json(const Column& column);

/// Columns and metadata as JSON: {"columns": [{"name", "unit", "type"}...], NAME: VALUE...}.
[[nodiscard]] std::string table_json(const std::vector<Column>& columns, const TableMetadata& metadata);

/// Exact simulated time of a tick in s: multiples of 125 ns, without trailing zeros.
[[nodiscard]] std::string exact_seconds(Tick tick, TickLength length);

}  // namespace kilotwin::recorder
