/// CsvWriter: writes a table (RFC 4180, rows end in LF) to a file, a gzipped file (.gz) or standard output (-).
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

namespace kilotwin {

/// `text` as a cell: quoted if it contains a comma, a quote, a line end, or leading or trailing blanks.
[[nodiscard]] std::string csv_cell(std::string_view text);

class CsvWriter {
 public:
  /// Creates or replaces the file and writes the header, e.g. "time_s,robot". Throws RunError.
  CsvWriter(std::filesystem::path file, std::string_view header);
  ~CsvWriter();
  CsvWriter(const CsvWriter&) = delete;
  CsvWriter& operator=(const CsvWriter&) = delete;

  /// Buffer of rows: append rows here, each with its line end.
  [[nodiscard]] std::string& rows() { return rows_; }
  /// Writes the buffer if it is long. Throws RunError.
  void flush_if_long();
  /// Writes the rest and closes the file. Without this call the file is incomplete. Throws RunError.
  void close();

 private:
  struct Gzip;
  void flush();
  [[noreturn]] void fail(const char* what, int error) const;

  std::filesystem::path file_;
  int descriptor_ = -1;
  std::unique_ptr<Gzip> gzip_;
  std::string rows_;
};

}  // namespace kilotwin
