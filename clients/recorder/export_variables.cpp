#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "clients/recorder/export.hpp"
#include "clients/recorder/latest_variables.hpp"
#include "clients/recorder/ordered_records.hpp"
#include "core/base/error.hpp"

namespace kilotwin::recorder {
namespace {

/// Where each robot's value stands in the records of a tick.
class Cells {
 public:
  Cells(std::size_t variables, std::size_t robots)
      : robots_(robots), at_(variables * robots, kNone), has_(robots, 0) {}

  void take(const std::vector<proto::VariableRecord>& records) {
    for (std::size_t r = 0; r < records.size(); ++r) {
      const proto::VariableRecord& record = records[r];
      for (int i = 0; i < record.robot_size(); ++i) {
        at_[record.variable() * robots_ + record.robot(i)] = {static_cast<std::uint32_t>(r),
                                                              static_cast<std::uint32_t>(i)};
        has_[record.robot(i)] = 1;
      }
    }
  }
  [[nodiscard]] bool any(std::size_t robot) const { return has_[robot] != 0; }
  void put(Table& table, const std::vector<proto::VariableRecord>& records, std::size_t variable, std::size_t robot,
           bool integer) const {
    const auto [record, index] = at_[variable * robots_ + robot];
    if (record == kNone.first) return table.missing();
    if (integer)
      table.integer(records[record].integer(static_cast<int>(index)));
    else
      table.number(records[record].number(static_cast<int>(index)));
  }
  void clear() {
    std::fill(at_.begin(), at_.end(), kNone);
    std::fill(has_.begin(), has_.end(), std::uint8_t{0});
  }

 private:
  static constexpr std::pair<std::uint32_t, std::uint32_t> kNone{0xffffffffu, 0};
  std::size_t robots_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> at_;
  std::vector<std::uint8_t> has_;
};

}  // namespace

std::uint64_t export_variables(Reader& recording, const std::filesystem::path& file,
                               const TableMetadata& metadata) {
  const proto::RecordingHeader& header = recording.header();
  if (header.variable_size() == 0) {
    throw UserError(
        fmt::format("{}: no variables; run again with recording {{ variable {{ name: \"NAME\" }} }} in the "
                    "experiment",
                    recording.path().string()));
  }
  std::vector<Column> columns{
      {"time_s", "s", CellType::kTime}, {"robot", "", CellType::kInteger}, {"group", "", CellType::kInteger}};
  for (const proto::VariableColumn& variable : header.variable()) columns.push_back(column_of(variable));
  const auto table = open_table(file, std::move(columns), metadata);
  const std::vector<std::uint32_t> groups = groups_of(header);
  const auto variables = static_cast<std::size_t>(header.variable_size());
  Cells cells(variables, header.robots());
  OrderedRecords ordered(recording, OrderedRecords::kVariables);
  while (ordered.next()) {
    const std::vector<proto::VariableRecord>& records = ordered.records().variables;
    cells.clear();
    cells.take(records);
    for (std::size_t robot = 0; robot < header.robots(); ++robot) {
      if (!cells.any(robot)) continue;
      table->time(ordered.tick(), recording.tick_length());
      table->integer(static_cast<std::int64_t>(robot));
      table->integer(groups[robot]);
      for (std::size_t v = 0; v < variables; ++v)
        cells.put(*table, records, v, robot, header.variable(static_cast<int>(v)).integer());
      table->end_row();
    }
  }
  table->close();
  return table->rows();
}

}  // namespace kilotwin::recorder
