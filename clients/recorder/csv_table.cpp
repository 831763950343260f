#include "clients/recorder/csv_table.hpp"

#include <charconv>
#include <cmath>

#include "core/base/error.hpp"
#include "core/os/files.hpp"

namespace kilotwin::recorder {
namespace {

std::string header_of(const std::vector<Column>& columns) {
  std::string text;
  for (const Column& column : columns) text += (text.empty() ? "" : ",") + csv_cell(column.name);
  return text;
}

/// Appends "-12.3450": value (|value| < 1e9) rounded to `decimals` places. Never "-0.0000".
void put_fixed(std::string& to, double value, int decimals) {
  std::int64_t unit = 1;
  for (int i = 0; i < decimals; ++i) unit *= 10;
  const double scaled = value * static_cast<double>(unit);
  auto units = static_cast<std::int64_t>(scaled + (scaled < 0 ? -0.5 : 0.5));
  char digits[48];
  char* at = digits;
  if (units < 0) {
    *at++ = '-';
    units = -units;
  }
  at = std::to_chars(at, digits + sizeof digits, units / unit).ptr;
  *at++ = '.';
  std::int64_t fraction = units % unit;
  for (int i = decimals - 1; i >= 0; --i) {
    at[i] = static_cast<char>('0' + fraction % 10);
    fraction /= 10;
  }
  to.append(digits, static_cast<std::size_t>(at - digits) + static_cast<std::size_t>(decimals));
}

}  // namespace

CsvTable::CsvTable(const std::filesystem::path& file, std::vector<Column> columns, const TableMetadata& metadata)
    : Table(columns.size()),
      file_(file),
      described_(std::move(columns)),
      metadata_(metadata),
      writer_(file, header_of(described_)) {}

std::string& CsvTable::begin_cell() {
  std::string& rows = writer_.rows();
  if (cell_++ > 0) rows += ',';
  return rows;
}

void CsvTable::integer(std::int64_t value) {
  char digits[24];
  begin_cell().append(digits, static_cast<std::size_t>(std::to_chars(digits, digits + 24, value).ptr - digits));
}

void CsvTable::number(double value) {
  constexpr double kMostFixed = 1e9;
  const int decimals = described_[cell_].decimals;
  std::string& rows = begin_cell();
  if (std::isnan(value)) return;
  if (decimals > 0 && std::abs(value) < kMostFixed) return put_fixed(rows, value, decimals);
  char digits[40];
  rows.append(digits, static_cast<std::size_t>(std::to_chars(digits, digits + sizeof digits, value).ptr - digits));
}

void CsvTable::time(Tick tick, TickLength length) {
  if (tick != time_) {
    time_ = tick;
    time_text_ = exact_seconds(tick, length);
  }
  begin_cell() += time_text_;
}

void CsvTable::text(std::string_view value) { begin_cell() += csv_cell(value); }

void CsvTable::end_row() {
  KILOTWIN_DEMAND(cell_ == columns_);
  cell_ = 0;
  writer_.rows() += '\n';
  writer_.flush_if_long();
  ++rows_;
}

void CsvTable::close() {
  writer_.close();
  if (!metadata_.empty() && file_ != "-" && std::filesystem::is_regular_file(file_))
    os::write_file(file_.string() + ".json", table_json(described_, metadata_));
}

}  // namespace kilotwin::recorder
