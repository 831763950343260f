#include "clients/recorder/table.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "clients/recorder/arrow_table.hpp"
#include "clients/recorder/csv_table.hpp"
#include "clients/recorder/npz_table.hpp"
#include "core/base/error.hpp"

namespace kilotwin::recorder {
namespace {

using nlohmann::ordered_json;

ordered_json described(const Column& column) {
  const char* const type = column.type == CellType::kInteger ? "integer"
                           : column.type == CellType::kText  ? "text"
                                                             : "number";
  return {{"name", column.name}, {"unit", column.unit}, {"type", type}};
}

}  // namespace

std::unique_ptr<Table> open_table(const std::filesystem::path& file, std::vector<Column> columns,
                                  const TableMetadata& metadata) {
  const std::string ending = file.extension().string();
  if (ending == ".npz") return std::make_unique<NpzTable>(file, std::move(columns), metadata);
  if (ending == ".arrow" || ending == ".feather")
    return std::make_unique<ArrowTable>(file, std::move(columns), metadata);
  for (const char* other : {".h5", ".hdf5", ".mcap", ".npy", ".parquet", ".xls", ".xlsx"}) {
    if (ending != other) continue;
    throw UserError(fmt::format(
        "{}: tables are not written as {}; give .csv, .csv.gz, .npz or .arrow, or - for standard output",
        file.string(), other));
  }
  return std::make_unique<CsvTable>(file, std::move(columns), metadata);
}

std::string column_json(const Column& column) {
  return described(column).dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

std::string table_json(const std::vector<Column>& columns, const TableMetadata& metadata) {
  ordered_json json;
  for (const auto& [name, value] : metadata) json[name] = value;
  ordered_json& list = json["columns"] = ordered_json::array();
  for (const Column& column : columns) list.push_back(described(column));
  return json.dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

std::string exact_seconds(Tick tick, TickLength length) {
  __extension__ using Wide = unsigned __int128;
  const Wide ns = static_cast<Wide>(tick.count()) * length.cycles() * 125;
  const auto seconds = static_cast<std::uint64_t>(ns / 1'000'000'000);
  std::string text = fmt::format("{}.{:09}", seconds, static_cast<std::uint64_t>(ns % 1'000'000'000));
  while (text.back() == '0') text.pop_back();
  if (text.back() == '.') text.pop_back();
  return text;
}

}  // namespace kilotwin::recorder
