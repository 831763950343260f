#include "clients/recorder/latest_variables.hpp"

#include <algorithm>

#include "core/observations/variable_sampler.hpp"

namespace kilotwin::recorder {

Column column_of(const proto::VariableColumn& variable) {
  return {variable.name(), variable.name() == kBatteryVariable ? "V" : "",
          variable.integer() ? CellType::kInteger : CellType::kNumber};
}

LatestVariables::LatestVariables(const proto::RecordingHeader& header, const std::vector<std::size_t>& chosen) {
  for (const std::size_t variable : chosen)
    values_.push_back(
        {variable, column_of(header.variable(static_cast<int>(variable))), std::vector<Cell>(header.robots())});
}

std::vector<Column> LatestVariables::columns() const {
  std::vector<Column> columns;
  for (const Values& values : values_) columns.push_back(values.column);
  return columns;
}

void LatestVariables::take(const std::vector<proto::VariableRecord>& records) {
  for (Values& values : values_) {
    bool sampled = false;
    for (const proto::VariableRecord& record : records) {
      if (record.variable() != values.variable) continue;
      // Behaviours hosts write a record each.
      if (!sampled) std::fill(values.of_robot.begin(), values.of_robot.end(), Cell());
      sampled = true;
      for (int i = 0; i < record.robot_size(); ++i) {
        Cell& cell = values.of_robot[record.robot(i)];
        cell.there = true;
        if (values.column.type == CellType::kInteger)
          cell.integer = record.integer(i);
        else
          cell.number = record.number(i);
      }
    }
  }
}

void LatestVariables::put(Table& table, std::size_t robot) const {
  for (const Values& values : values_) {
    const Cell& cell = values.of_robot[robot];
    if (!cell.there)
      table.missing();
    else if (values.column.type == CellType::kInteger)
      table.integer(cell.integer);
    else
      table.number(cell.number);
  }
}

}  // namespace kilotwin::recorder
