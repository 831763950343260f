/// Residuals of watched robots over time: whitened innovations, one row per robot and second of simulated time. Sums over a second
/// keep the table small and stay standard normal, because innovations are independent under the model.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "clients/monitor/robot_filter.hpp"

namespace kilotwin::monitor {

/// One robot within one second.
struct Residual {
  double to_s = 0;  ///< end of the second
  std::uint32_t robot = 0;
  std::uint32_t samples = 0;    ///< measurements that were compared, > 0
  std::uint32_t headings = 0;   ///< those with a heading
  std::uint32_t tested = 0;     ///< those of an undisturbed robot: only these count for alarms
  std::array<double, 3> sum{};  ///< of the innovations along, across, and of the heading
  double squares = 0;           ///< sum of the squares of all components
};

class Residuals {
 public:
  explicit Residuals(const std::vector<std::uint32_t>& robots);

  /// `entry`: index into the robots.
  void add(std::size_t entry, const Innovation& innovation, bool is_tested);
  /// Ends the second that holds the instants before `now_s`, if `now_s` lies in another one. Instants ascend.
  void advance(double now_s);
  /// Those of whole seconds since the last call, by time, then robot.
  [[nodiscard]] std::vector<Residual> take() { return std::exchange(closed_, {}); }

 private:
  std::vector<Residual> open_;  ///< per robot
  std::vector<Residual> closed_;
  std::int64_t second_ = 0;  ///< that is open
};

/// The table of residuals: header and rows, without line ends. Sums are divided by the root of their number: standard normal under
/// the model. The mean square is over all components: 1 under the model.
[[nodiscard]] std::string residuals_header();
[[nodiscard]] std::string residuals_row(const Residual& residual);

}  // namespace kilotwin::monitor
