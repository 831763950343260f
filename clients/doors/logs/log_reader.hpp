/// Logs of trackers: rows of tab-separated numbers, as experiments of ARK and as LARS write them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <istream>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "idl/door.pb.h"

namespace kilotwin::doors {

/// A robot in a row; coordinates in the log's own unit. A position may be no finite number: the robot was lost.
struct LogRobot {
  std::uint64_t number = 0;
  double x = 0, y = 0;
  std::optional<double> heading_rad;  ///< anticlockwise from the picture's x axis
  std::optional<double> vx, vy;       ///< in the log's coordinates
  std::uint8_t led = 255;             ///< r | g << 2 | b << 4; 255: not known
};

struct LogRow {
  double time_s = 0;
  std::vector<LogRobot> robots;  ///< each number once
};

/// Reads rows one by one. A line ends with LF or CR LF; empty lines and tabs at a line's end say nothing. Times never go back.
/// All members throw UserError "FILE:LINE:COLUMN: ...", columns counting octets from 1.
class LogReader {
 public:
  /// `log`: as core/experiment has checked it.
  LogReader(const std::filesystem::path& file, const proto::LogDoor& log);
  /// The same from a stream; `name` stands in errors.
  LogReader(std::unique_ptr<std::istream> stream, std::string name, const proto::LogDoor& log);
  [[nodiscard]] std::optional<LogRow> next();

 private:
  struct Field {
    std::string_view text;
    std::size_t column;
  };
  void skip_header();
  bool next_line();
  void split();
  void find_columns();
  [[noreturn]] void complain(std::size_t column, const std::string& what) const;
  [[nodiscard]] double number(const Field& field, const char* what) const;
  [[nodiscard]] std::uint64_t whole(const Field& field, const char* what) const;
  [[nodiscard]] LogRobot robot(const Field* fields) const;

  std::unique_ptr<std::istream> stream_;
  std::string name_;
  bool lars_;
  double time_unit_s_;
  std::size_t columns_;  ///< per robot; 0: the first row tells
  std::string line_;
  std::uint64_t line_number_ = 0;
  std::vector<Field> fields_;
  std::optional<double> last_time_;
};

}  // namespace kilotwin::doors
