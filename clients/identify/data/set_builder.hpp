/// A measured set, row by row: from trajectories.csv or from the tables of other programs.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "clients/identify/data/measured_set.hpp"

namespace kilotwin::identify {

class SetBuilder {
 public:
  /// Rows may come in any order. `run`: UTF-8.
  void add(std::string_view run, std::uint32_t robot, const Sample&);
  /// Reads DIR/commands.csv[.gz], if it is there; call it after all samples: commands of robots without samples are ignored. Throws
  /// UserError with file, line and column.
  void add_commands(const std::filesystem::path& directory);
  /// Ascending times and robots. Without add_commands() of a file, robots drive straight all the time; with it, they rest before their
  /// first command.
  [[nodiscard]] MeasuredSet finish();

 private:
  [[nodiscard]] Track* find(std::string_view run, std::uint32_t robot);

  MeasuredSet set_;
  std::map<std::string, std::size_t, std::less<>> runs_;
  std::vector<std::map<std::uint32_t, Track>> tracks_;  ///< per run
  // The track of the last row: tables name a robot many times in sequence.
  Track* last_ = nullptr;
  std::string last_run_;
};

/// DIR/STEM.csv or DIR/STEM.csv.gz.
[[nodiscard]] std::optional<std::filesystem::path> find_table(const std::filesystem::path& directory,
                                                              const char* stem);

/// The name of the run whose table this is: the file's, without its endings. Throws UserError if it is not UTF-8.
[[nodiscard]] std::string run_of_file(const std::filesystem::path& file);

}  // namespace kilotwin::identify
