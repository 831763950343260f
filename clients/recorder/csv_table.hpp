/// CsvTable: a Table as CSV.
#pragma once

#include "clients/recorder/table.hpp"
#include "core/csv/csv_writer.hpp"

namespace kilotwin::recorder {

class CsvTable final : public Table {
 public:
  CsvTable(const std::filesystem::path& file, std::vector<Column> columns, const TableMetadata& metadata);

  void integer(std::int64_t value) override;
  void number(double value) override;
  void time(Tick tick, TickLength length) override;
  void text(std::string_view value) override;
  void missing() override { begin_cell(); }
  void end_row() override;
  void close() override;

 private:
  std::string& begin_cell();

  const std::filesystem::path file_;
  const std::vector<Column> described_;
  const TableMetadata metadata_;
  CsvWriter writer_;
  std::size_t cell_ = 0;  ///< of the row at hand
  Tick time_{-1};         ///< of which time_text_ is
  std::string time_text_;
};

}  // namespace kilotwin::recorder
