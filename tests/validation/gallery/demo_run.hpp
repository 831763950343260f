/// One run of an experiment of experiments/gallery, and what its recording says.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace kilotwin::validation {

struct DemoSettings {
  std::string kilotwin;            ///< the program
  std::filesystem::path folder;    ///< experiments/gallery
  std::filesystem::path scratch;   ///< directory for runs
  std::filesystem::path pictures;  ///< where the runs' pictures go; empty: nowhere
};

/// A robot's LED at a time. Channels as in the recording: r | g << 2 | b << 4.
struct LedChange {
  double time_s = 0;
  std::uint32_t led = 0;
};

struct DemoRun {
  double range_mm = 0;  ///< `radio.range_mm` of the experiment as it was run
  double duration_s = 0;
  std::vector<double> time_s;                       ///< of the recorded states
  std::vector<std::vector<double>> x_mm, y_mm;      ///< per state: per robot
  std::vector<std::uint8_t> led;                    ///< per robot, in the last state
  std::vector<std::vector<LedChange>> led_changes;  ///< per robot; with `event: LED`
  std::vector<int> sent, received;                  ///< messages per robot; with their events
  /// Of each recorded variable: its values over time, per robot.
  std::map<std::string, std::vector<std::pair<double, std::vector<double>>>> variables;

  [[nodiscard]] std::size_t robots() const { return led.size(); }
  [[nodiscard]] std::size_t last() const { return time_s.size() - 1; }
  /// Between the centres of robots `a` and `b` in a state.
  [[nodiscard]] double distance_mm(std::size_t state, std::size_t a, std::size_t b) const;
  /// The last values of a recorded variable, per robot. Throws RunError where there are none.
  [[nodiscard]] const std::vector<double>& values(const std::string& variable) const;
  /// Hops from a robot to all others through links of at most `range_mm` in a state; -1: not reached.
  [[nodiscard]] std::vector<int> hops_from(std::size_t robot, std::size_t state) const;
};

/// Runs experiment `name` in one process with more arguments. Throws RunError with what it said where it fails.
/// Its picture goes to `picture` of the pictures' folder, unless `picture` is empty.
[[nodiscard]] DemoRun run_demo(const DemoSettings& settings, const std::string& name,
                               const std::vector<std::string>& words = {}, const std::string& picture = "");

}  // namespace kilotwin::validation
