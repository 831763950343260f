/// ResidualCurves: the residuals of the monitor over time, from the run's residuals.csv, which may still grow.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "clients/view/curves.hpp"

namespace kilotwin::view {

class ResidualCurves {
 public:
  /// `directory`: of the run. The table of its last replay serves where the run itself had no monitor.
  explicit ResidualCurves(const std::filesystem::path& directory);

  /// There is a table.
  [[nodiscard]] bool any() const { return file_.is_open(); }

  /// Of a robot its innovations along, across and of the heading, each standard normal under the model. Of all robots the mean square,
  /// 1 under the model. At most `most` points: of longer runs each point is of several seconds. Reads for 40 ms at most.
  [[nodiscard]] Curves curves(std::optional<std::uint32_t> robot, std::size_t most);

 private:
  /// Sums over a second.
  struct Sums {
    double samples = 0, headings = 0, along = 0, across = 0, heading = 0, squares = 0;
    void add(const Sums& other);
  };
  [[nodiscard]] bool read_on();
  void take(const std::string& row);

  std::ifstream file_;
  std::string part_;  ///< of a row that is still being written
  std::map<std::int64_t, Sums> swarm_;
  std::map<std::uint32_t, std::map<std::int64_t, Sums>> robots_;
};

}  // namespace kilotwin::view
