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
  /// `most_waiting`: octets that wait in memory; more wait in temporary files.
  NpzTable(std::filesystem::path file, std::vector<Column> columns, const TableMetadata& metadata,
           std::size_t most_waiting = std::size_t{64} << 20);

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
  /// A column's cells wait until all rows are there, because an array's header precedes them and says how many they are. They wait in
  /// blocks: whole numbers and texts in as few octets as the block's range needs. The blocks are in memory, or beyond most_waiting_ of
  /// all columns in temporary files.
  struct Waiting {
    std::vector<std::uint64_t> cells;  ///< of the block at hand; texts as numbers in the order of their first use
    std::string blocks;
    File spilled;  ///< blocks before those; none: there are none
    bool any_missing = false;
    std::map<std::string, std::int64_t, std::less<>> texts{};
    std::vector<std::string> by_number{};
    std::size_t longest = 1;  ///< code points of the longest text
  };
  void put(std::uint64_t bits);
  void pack(std::size_t column);
  void spill();
  /// The cells of a column after its array's header.
  void copy(Waiting& waiting, const Column& column);
  void append(const void* octets, std::size_t size);
  [[noreturn]] void fail() const;

  const std::filesystem::path file_;
  const std::vector<Column> described_;
  const std::string comment_;
  const std::size_t most_waiting_;
  std::vector<Waiting> waiting_;
  std::size_t cell_ = 0, packed_ = 0;  ///< packed_: octets of blocks in memory
  // The array at hand.
  File output_;
  std::uint64_t written_ = 0;
  std::uint32_t crc_ = 0;
};

}  // namespace kilotwin::recorder
