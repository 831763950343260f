#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <optional>

#include "clients/recorder/export.hpp"
#include "core/base/error.hpp"
#include "core/os/files.hpp"

namespace kilotwin::recorder {
namespace {

/// Columns that every row of station-N.tsv begins with.
constexpr std::size_t kFixed = 6;

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(separator), text.size());
    parts.push_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return parts;
}

std::optional<double> number_of(std::string_view cell) {
  double value = 0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (error != std::errc() || end != cell.data() + cell.size()) return std::nullopt;
  return value;
}

void put_number(Table& table, std::string_view cell) {
  if (const auto value = number_of(cell))
    table.number(*value);
  else
    table.missing();
}

std::string name_of(const proto::VirtualEnvironment& environment) {
  if (environment.has_hub()) return "hub";
  if (environment.has_foraging()) return "foraging";
  if (environment.plugin().source_size() == 0) return "plugin";
  return std::filesystem::path(environment.plugin().source(0)).stem().string();
}

}  // namespace

std::uint64_t export_environment(const std::filesystem::path& run_directory, const proto::RecordingHeader& header,
                                 const std::filesystem::path& file, const TableMetadata& metadata) {
  std::vector<std::string> logs(static_cast<std::size_t>(header.environment_size()));
  std::size_t most = 0;
  bool any = false;
  for (std::size_t i = 0; i < logs.size(); ++i) {
    const auto text = os::read_if_there(run_directory / fmt::format("station-{}.tsv", i));
    if (!text) continue;
    any = true;
    logs[i] = *text;
    for (const std::string_view row : split(logs[i], '\n')) most = std::max(most, split(row, '\t').size());
  }
  if (!any)
    throw UserError(
        fmt::format("{}: no logs of environments; the experiment's station has none", run_directory.string()));
  std::vector<Column> columns{{"environment", "", CellType::kInteger},
                              {"name", "", CellType::kText},
                              {"time_s", "s", CellType::kNumber},
                              {"robot", "", CellType::kNumber},
                              {"colour", "", CellType::kText},
                              {"x", "", CellType::kNumber},
                              {"y", "", CellType::kNumber},
                              {"orientation_deg", "deg", CellType::kNumber}};
  for (std::size_t i = kFixed; i < most; ++i)
    columns.push_back({fmt::format("value_{}", i - kFixed + 1), "", CellType::kText});
  const auto table = open_table(file, std::move(columns), metadata);
  for (std::size_t environment = 0; environment < logs.size(); ++environment) {
    const std::string name = name_of(header.environment(static_cast<int>(environment)));
    for (const std::string_view row : split(logs[environment], '\n')) {
      std::vector<std::string_view> cells = split(row, '\t');
      if (cells.size() < kFixed || !number_of(cells[0])) continue;
      cells.resize(std::max(most, kFixed));
      table->integer(static_cast<std::int64_t>(environment));
      table->text(name);
      put_number(*table, cells[0]);
      put_number(*table, cells[1]);
      table->text(cells[2]);
      for (std::size_t i = 3; i < kFixed; ++i) put_number(*table, cells[i]);
      for (std::size_t i = kFixed; i < most; ++i) table->text(cells[i]);
      table->end_row();
    }
  }
  table->close();
  return table->rows();
}

}  // namespace kilotwin::recorder
