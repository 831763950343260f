#include "services/ark/foraging_environment.hpp"

#include <algorithm>

#include "core/base/error.hpp"
#include "core/base/state_hash.hpp"
#include "core/math/elementary.h"
#include "idl/checkpoint.pb.h"

namespace kilotwin::ark {
namespace {

enum : std::uint8_t { kInside = 0, kFarthest = 13, kSwap = 14, kNoFood = 15 };
constexpr double kStep_mm = 100, kTolerance_mm = 30;
constexpr std::uint16_t kToHome = 0, kToFood = 1;

bool shows_blue(std::uint8_t led) { return (led & 0x30) != 0 && (led & 0x0f) == 0; }

double squared(double x) { return x * x; }

}  // namespace

ForagingEnvironment::ForagingEnvironment(const ForagingSettings& setting, std::uint32_t robots)
    : setting_(setting), loads_left_(setting.loads), carries_(robots, '\0') {}

double ForagingEnvironment::food_radius_mm() const {
  return setting_.food_radius_mm * loads_left_ / setting_.loads;
}

double ForagingEnvironment::home_radius_mm() const {
  return setting_.home_radius_mm + setting_.food_radius_mm * delivered_ / setting_.loads;
}

bool ForagingEnvironment::is_within(const TrackedRobot& robot, bool of_home, double margin_mm) const {
  const double x_mm = of_home ? setting_.home_x_mm : setting_.food_x_mm;
  const double y_mm = of_home ? setting_.home_y_mm : setting_.food_y_mm;
  const double radius_mm = (of_home ? home_radius_mm() : food_radius_mm()) + margin_mm;
  return squared(robot.p_WR.x_mm - x_mm) + squared(robot.p_WR.y_mm - y_mm) <= squared(radius_mm);
}

std::optional<ArkMessage> ForagingEnvironment::sense(const TrackedRobot& robot) {
  const auto id = static_cast<std::uint16_t>(robot.robot);
  char& carries = carries_[robot.robot];
  const auto swap = [&] { return ArkMessage{id, kSwap, carries != 0 ? kToHome : kToFood}; };
  if (shows_blue(robot.led)) {
    if (carries != 0 && is_within(robot, true, kTolerance_mm)) {
      carries = 0;
      ++delivered_;
      return swap();
    }
    if (carries == 0 && loads_left_ > 0 && is_within(robot, false, kTolerance_mm)) {
      carries = 1;
      --loads_left_;
      return swap();
    }
    // It stands where it was told to change, and has not heard it.
    if (is_within(robot, carries == 0, kTolerance_mm)) return swap();
  }
  if (carries == 0 && loads_left_ == 0) return ArkMessage{id, kNoFood, 0};
  const bool home = carries != 0;
  const Point2 goal =
      home ? Point2{setting_.home_x_mm, setting_.home_y_mm} : Point2{setting_.food_x_mm, setting_.food_y_mm};
  const double x_mm = goal.x_mm - robot.p_WR.x_mm, y_mm = goal.y_mm - robot.p_WR.y_mm;
  const double distance_mm = __builtin_sqrt(x_mm * x_mm + y_mm * y_mm);
  if (!home && distance_mm > setting_.scent_radius_mm) return std::nullopt;
  std::uint8_t type = kInside;
  if (!is_within(robot, home, 0))
    type = static_cast<std::uint8_t>(std::min<double>(kFarthest, kt_floor(distance_mm / kStep_mm) + 1));
  return ArkMessage{id, type, bearing_deg(robot.p_WR, goal)};
}

std::uint64_t ForagingEnvironment::word() const {
  std::uint64_t word = hash_mix(loads_left_, delivered_);
  for (const char carries : carries_) word = hash_mix(word, static_cast<std::uint64_t>(carries));
  return word;
}

void ForagingEnvironment::save(proto::EnvironmentState& state) const {
  state.set_loads_left(loads_left_);
  state.set_delivered(delivered_);
  state.set_carries(carries_);
}

void ForagingEnvironment::load(const proto::EnvironmentState& state) {
  if (state.carries().size() != carries_.size() || state.loads_left() > setting_.loads)
    throw RunError("the checkpoint is of another virtual environment; resume from another one");
  loads_left_ = state.loads_left();
  delivered_ = state.delivered();
  carries_ = state.carries();
}

}  // namespace kilotwin::ark
