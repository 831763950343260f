/// ArrowTable: a Table as an Arrow IPC file, which is also called Feather, version 2. Polars, pandas, R and DuckDB read it. Missing
/// cells are nulls.
#pragma once

#include <string>

#include "clients/recorder/table.hpp"
#include "core/os/files.hpp"

namespace kilotwin::recorder {

class ArrowTable final : public Table {
 public:
  /// Rows of a record batch: what is kept in memory.
  static constexpr std::size_t kRowsOfBatch = 65'536;

  ArrowTable(std::filesystem::path file, std::vector<Column> columns, const TableMetadata& metadata);

  void integer(std::int64_t value) override;
  void number(double value) override;
  void time(Tick tick, TickLength length) override { number(length.seconds_at(tick)); }
  void text(std::string_view value) override;
  void missing() override;
  void end_row() override;
  void close() override;

 private:
  /// Cells of one column in the batch at hand, as Arrow lays them out.
  struct Cells {
    std::string values;                ///< 8 octets per number; texts one after the other
    std::vector<std::int32_t> begins;  ///< of texts: where each begins, and where the last ends
    std::vector<std::uint8_t> valid;   ///< a bit per cell
    std::int64_t missing = 0;
  };
  /// Where a batch lies in the file.
  struct Place {
    std::int64_t offset = 0, body = 0;
    std::int32_t head = 0;
  };

  void put(std::uint64_t bits);
  void mark(bool valid);
  void write_batch();
  /// A message: its header as a flatbuffer, then its body.
  Place write_message(const std::string& header, const std::string& body);
  void write(const void* octets, std::size_t size);

  const std::vector<Column> described_;
  const TableMetadata metadata_;
  os::OutputFile output_;
  std::int64_t written_ = 0;
  std::vector<Cells> cells_;
  std::size_t cell_ = 0, rows_of_batch_ = 0;
  std::vector<Place> batches_;
};

}  // namespace kilotwin::recorder
