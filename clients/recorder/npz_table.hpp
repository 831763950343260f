/// NpzTable: a Table as NumPy's .npz, an archive with one array per column. numpy.load() reads it; pandas.DataFrame(dict(...)) makes
/// a data frame of it. Each array's comment is column_json(). The archive's comment is table_json(), without columns if it would be
/// too long.
#pragma once

#include <cstdio>
#include <map>

#include "clients/recorder/table.hpp"

namespace kilotwin::recorder {

class NpzTable final : public Table {
 public:
  NpzTable(std::filesystem::path file, std::vector<Column> columns, const TableMetadata& metadata);

  void integer(std::int64_t value) override;
  void number(double value) override;
  void time(Tick tick, TickLength length) override { number(length.seconds_at(tick)); }
  void text(std::string_view value) override;
  void missing() override;
  void end_row() override;
  void close() override;

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  using File = std::unique_ptr<std::FILE, Close>;
  /// A column's cells wait in a temporary file, because an array's header precedes them and says how many they are.
  struct Spill {
    File cells;  ///< 8 octets per cell; texts as numbers in the order of their first use
    bool any_missing = false;
    std::map<std::string, std::int64_t, std::less<>> texts{};
    std::vector<std::string> by_number{};
    std::size_t longest = 1;  ///< code points of the longest text
  };
  void put(std::uint64_t bits);
  void copy(Spill& spill, const Column& column);
  void append(const void* octets, std::size_t size);
  [[noreturn]] void fail() const;

  const std::filesystem::path file_;
  const std::vector<Column> described_;
  const std::string comment_;
  std::vector<Spill> spills_;
  std::size_t cell_ = 0;
  // The array at hand.
  File output_;
  std::uint64_t written_ = 0;
  std::uint32_t crc_ = 0;
};

}  // namespace kilotwin::recorder
