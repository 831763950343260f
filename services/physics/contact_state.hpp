/// What contact keeps from tick to tick besides poses. Units of a sub-step: a velocity is a way per sub-step, and a force is
/// the change of a free robot's velocity by it, so that kInertia x robot_mass / sub_step^2 turns it into newtons.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace kilotwin::physics {

/// A robot that touches others, or that slips against its drive.
struct Press {
  static constexpr std::size_t kMost = 12;  ///< six equal discs fit around one; the rest is for walls and bodies
  struct Touch {
    double push_mm = 0,
           rub_mm = 0;  ///< push: above 0; rub: friction, on this robot clockwise about it, on the other likewise
    std::uint32_t other = 0;  ///< robot, or robots + movable body, or beyond: walls

    bool operator==(const Touch&) const = default;
  };

  double slip_x_mm = 0, slip_y_mm = 0;  ///< velocity less that of the drive
  std::uint32_t contacts = 0;
  std::array<Touch, kMost> touch{};  ///< ascending by the other; the first `contacts` count

  [[nodiscard]] bool any() const { return contacts != 0 || slip_x_mm != 0 || slip_y_mm != 0; }
  /// The contact with this other; without forces where there is none.
  [[nodiscard]] Touch touch_of(std::uint32_t id) const {
    for (std::uint32_t p = 0; p < contacts; ++p) {
      if (touch[p].other == id) return touch[p];
    }
    return {};
  }
};

/// All robots' presses, and beside them which of them are any, since most robots touch nobody.
class PressTable {
 public:
  explicit PressTable(std::size_t robots) : presses_(robots), any_(robots, 0) {}

  [[nodiscard]] std::size_t size() const { return presses_.size(); }
  [[nodiscard]] const Press& operator[](std::size_t robot) const { return presses_[robot]; }
  [[nodiscard]] bool any(std::size_t robot) const { return any_[robot] != 0; }
  void set(std::size_t robot, const Press& press) {
    presses_[robot] = press;
    any_[robot] = press.any();
  }
  void clear(std::size_t robot) {
    if (any_[robot] == 0) return;
    presses_[robot].slip_x_mm = presses_[robot].slip_y_mm = 0;
    presses_[robot].contacts = 0;
    any_[robot] = 0;
  }
  /// Changes it in place: `change(press)`, whose result this returns.
  template <class Change> bool change(std::size_t robot, Change&& change) {
    const bool result = change(presses_[robot]);
    any_[robot] = presses_[robot].any();
    return result;
  }

 private:
  std::vector<Press> presses_;
  std::vector<std::uint8_t> any_;
};

/// A movable body: pose of its centre and velocity.
struct MovableState {
  double x_mm = 0, y_mm = 0, heading_rad = 0;
  double vx_mm = 0, vy_mm = 0, turn_rad = 0;  ///< per sub-step

  [[nodiscard]] bool moves() const { return vx_mm != 0 || vy_mm != 0 || turn_rad != 0; }
};

}  // namespace kilotwin::physics
