/// Foraging as ARK demonstrates it: virtual food, a virtual home, and robots that carry one load at a time.
///
/// What a robot is sent: 0 inside its goal; 1..13 outside, 1 within 100 mm of its centre and one more for every 100 mm; 14 that
/// it has changed its goal, with 0 to the home and 1 to the food; 15 that no food is left. The data of 0..13 is the bearing of
/// the goal's centre.
///
/// A robot asks by a LED of pure blue. One that asks within 30 mm of its goal gets a load there, or puts it down. It is told
/// so until it ceases to ask. (Distances and tolerance: the loop functions of ARK's demonstration in ARGoS.)
#pragma once

#include <string>

#include "services/ark/virtual_environment.hpp"

namespace kilotwin::ark {

class ForagingEnvironment final : public VirtualEnvironment {
 public:
  ForagingEnvironment(const ForagingSettings&, std::uint32_t robots);

  [[nodiscard]] std::optional<ArkMessage> sense(const TrackedRobot& robot) override;
  [[nodiscard]] std::uint64_t word() const override;
  void save(proto::EnvironmentState&) const override;
  void load(const proto::EnvironmentState&) override;

  [[nodiscard]] std::uint32_t loads_left() const { return loads_left_; }
  [[nodiscard]] std::uint32_t delivered() const { return delivered_; }
  [[nodiscard]] bool carries(std::uint32_t robot) const { return carries_[robot] != 0; }
  [[nodiscard]] double food_radius_mm() const;
  [[nodiscard]] double home_radius_mm() const;

 private:
  [[nodiscard]] bool is_within(const TrackedRobot&, bool of_home, double margin_mm) const;

  const ForagingSettings setting_;
  std::uint32_t loads_left_, delivered_ = 0;
  std::string carries_;  ///< per robot
};

}  // namespace kilotwin::ark
