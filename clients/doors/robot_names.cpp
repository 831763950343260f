#include "clients/doors/robot_names.hpp"

#include <algorithm>
#include <charconv>
#include <iterator>

namespace kilotwin::doors {
namespace {

constexpr std::string_view kNumber = "{number}";

}  // namespace

RobotNames::RobotNames(const proto::DoorRobots& robots, std::vector<bool> tracked)
    : tracked_(std::move(tracked)), first_number_(robots.first_number()), first_robot_(robots.first_robot()) {
  for (const proto::NamedRobot& robot : robots.robot()) listed_.emplace(robot.name(), robot.robot());
  const std::size_t at = robots.pattern().find(kNumber);
  prefix_ = robots.pattern().substr(0, at);
  suffix_ = robots.pattern().substr(at + kNumber.size());
  if (!robots.has_first_robot()) {
    const auto first = std::find(tracked_.begin(), tracked_.end(), true);
    first_robot_ = static_cast<std::uint32_t>(std::distance(tracked_.begin(), first));
  }
}

std::optional<std::uint32_t> RobotNames::of_number(std::uint64_t number) const {
  if (const auto found = listed_.find(std::to_string(number)); found != listed_.end())
    return is_tracked(found->second) ? std::optional(found->second) : std::nullopt;
  return counted(number);
}

std::optional<std::uint64_t> RobotNames::number_of(std::uint32_t robot) const {
  for (const auto& [name, listed] : listed_) {
    std::uint64_t number = 0;
    const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), number);
    const bool digits = error == std::errc() && end == name.data() + name.size();
    if (listed == robot && digits) return of_number(number) == robot ? std::optional(number) : std::nullopt;
  }
  if (robot < first_robot_) return std::nullopt;
  const std::uint64_t number = std::uint64_t{first_number_} + robot - first_robot_;
  return of_number(number) == robot ? std::optional(number) : std::nullopt;
}

std::optional<std::uint32_t> RobotNames::counted(std::uint64_t number) const {
  if (number < first_number_) return std::nullopt;
  const std::uint64_t beyond = number - first_number_;
  if (beyond >= tracked_.size() || !is_tracked(first_robot_ + beyond)) return std::nullopt;
  return static_cast<std::uint32_t>(first_robot_ + beyond);
}

std::optional<std::uint32_t> RobotNames::of_name(std::string_view name) const {
  if (const auto found = listed_.find(name); found != listed_.end()) {
    return is_tracked(found->second) ? std::optional(found->second) : std::nullopt;
  }
  const std::size_t ends = prefix_.size() + suffix_.size();
  if (name.size() <= ends || !name.starts_with(prefix_) || !name.ends_with(suffix_)) return std::nullopt;
  const std::string_view digits = name.substr(prefix_.size(), name.size() - ends);
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  if (error != std::errc() || end != digits.data() + digits.size()) return std::nullopt;
  return counted(number);
}

std::vector<std::string> RobotNames::names() const {
  std::map<std::uint32_t, std::string> by_robot;
  for (const auto& [name, robot] : listed_) {
    if (is_tracked(robot)) by_robot.emplace(robot, name);
  }
  for (std::uint32_t robot = first_robot_; robot < tracked_.size(); ++robot) {
    if (!tracked_[robot]) continue;
    const std::uint64_t number = std::uint64_t{first_number_} + robot - first_robot_;
    std::string name = prefix_;
    name.append(std::to_string(number)).append(suffix_);
    if (!listed_.contains(name)) by_robot.emplace(robot, std::move(name));
  }
  std::vector<std::string> all;
  all.reserve(by_robot.size());
  for (auto& [robot, name] : by_robot) all.push_back(std::move(name));
  return all;
}

}  // namespace kilotwin::doors
