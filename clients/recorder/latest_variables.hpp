/// LatestVariables: the newest recorded value of variables per robot, for tables whose rows are states.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "clients/recorder/table.hpp"
#include "idl/recording.pb.h"

namespace kilotwin::recorder {

class LatestVariables {
 public:
  /// `chosen`: variables, as numbered by the header.
  LatestVariables(const proto::RecordingHeader& header, const std::vector<std::size_t>& chosen);

  /// The columns of the chosen variables, in their order.
  [[nodiscard]] std::vector<Column> columns() const;
  /// Takes all records of one tick; ticks ascend. A robot that is in none of a variable's records has no value from then on.
  void take(const std::vector<proto::VariableRecord>& records);
  /// Writes the robot's cells of columns().
  void put(Table& table, std::size_t robot) const;
  [[nodiscard]] bool empty() const { return values_.empty(); }

 private:
  struct Cell {
    bool there = false;
    std::int64_t integer = 0;
    double number = 0;
  };
  /// Of one variable.
  struct Values {
    std::size_t variable = 0;
    Column column;
    std::vector<Cell> of_robot{};
  };
  std::vector<Values> values_;
};

/// The column of a variable in tables.
[[nodiscard]] Column column_of(const proto::VariableColumn& variable);

}  // namespace kilotwin::recorder
