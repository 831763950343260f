/// Curves over time, and what the page is told of them, as JSON.
#pragma once

#include <chrono>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace kilotwin::view {

/// A curve has so many points at most.
inline constexpr std::size_t kMostPoints = 1000;
/// One answer reads a recording for so long at most, because all viewers wait for it.
inline constexpr std::chrono::milliseconds kReadFor{40};
/// Variables and events reach the recording at most so many ticks after the newest one, and some more.
inline constexpr std::int64_t kSettled_ticks = 128;
/// A value that does not exist.
inline constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

struct Curves {
  std::vector<double> time_s;
  std::vector<std::string> names;
  std::vector<std::vector<double>> values;  ///< per name; not a number: none
  bool whole = true;                        ///< false: the next answer has more
};

/// A quantity that can be plotted.
struct PlotEntry {
  std::string name, title, unit;
  bool of_swarm = true, of_robot = false;
  bool is_variable = false;  ///< of the robots' programs
  std::string absent;        ///< why it has no curve, one line; empty: it has one
};

/// A message of type "plots". Plots have numbers from 0.
[[nodiscard]] std::string plots_text(const std::vector<PlotEntry>& plots);
/// A message of type "plot": numbers with six digits, null where there is none.
[[nodiscard]] std::string plot_text(std::uint32_t number, std::optional<std::uint32_t> robot, const Curves& curves);

}  // namespace kilotwin::view
