/// PrintedLines: what all robots of a run have printed, in the order of time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace kilotwin::mcap {

class PrintedLines {
 public:
  struct Line {
    double time_s;  ///< when the robot began to print it
    std::uint32_t robot;
    std::string text;  ///< without the time and the end of the line
  };
  /// Most text that is read, of all robots together; a last line says that it was more.
  static constexpr std::size_t kMostOctets = 64 << 20;

  /// Reads the logs of robots 0 to `robots` - 1 in a run directory. Robots that have printed nothing have none.
  PrintedLines(const std::filesystem::path& run_directory, std::uint32_t robots);

  /// The next line that began before `end_s`; nullptr: there is none.
  [[nodiscard]] const Line* next_before(double end_s);

 private:
  std::vector<Line> lines_;  // by ascending time, then robot
  std::size_t next_ = 0;
};

}  // namespace kilotwin::mcap
