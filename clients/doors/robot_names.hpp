/// The robot of the experiment that the other system means by a name or a number.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "idl/door.pb.h"

namespace kilotwin::doors {

class RobotNames {
 public:
  /// `tracked[i]`: robot i is tracked; any other is meant by no name.
  RobotNames(const proto::DoorRobots& robots, std::vector<bool> tracked);

  [[nodiscard]] std::optional<std::uint32_t> of_name(std::string_view name) const;
  /// A listed name that consists of the number's digits counts, too.
  [[nodiscard]] std::optional<std::uint32_t> of_number(std::uint64_t number) const;
  /// The number that means the robot; absent: none does.
  [[nodiscard]] std::optional<std::uint64_t> number_of(std::uint32_t robot) const;
  /// Of every tracked robot that has a name, ordered by robot.
  [[nodiscard]] std::vector<std::string> names() const;
  [[nodiscard]] std::size_t robots() const { return tracked_.size(); }

 private:
  [[nodiscard]] std::optional<std::uint32_t> counted(std::uint64_t number) const;
  [[nodiscard]] bool is_tracked(std::uint64_t robot) const { return robot < tracked_.size() && tracked_[robot]; }

  std::map<std::string, std::uint32_t, std::less<>> listed_;
  std::vector<bool> tracked_;
  std::string prefix_, suffix_;  ///< of the pattern
  std::uint32_t first_number_, first_robot_;
};

}  // namespace kilotwin::doors
