/// The Jacobi passes of a tick over movable bodies: rigid, convex, held by dry friction on the floor. contact.hpp states the law.
///
/// A velocity is (vx, vy, rho w), with rho the mean distance of the resting area from its centre. Dry friction holds forces and
/// moments within the ellipsoid |f|^2 + (M / rho)^2 <= (friction m g)^2 (the limit surface of Howe and Cutkosky 1996, whose two
/// axes are exact where the weight rests evenly). Inertia about the centre is taken as m rho^2, so that friction takes off the
/// length of the velocity in these coordinates; it matters in the moment of impact alone.
///
/// Forces between movable bodies are found anew in each sub-step, together with friction and for all bodies that can touch
/// each other at once (over-relaxed projection, Gauss-Seidel in ascending order): so they pass through any chain of bodies
/// within the sub-step, and such bodies are one hop together.
#pragma once

#include <cstdint>
#include <vector>

#include "core/plan/plan.hpp"
#include "services/physics/contact_limits.hpp"
#include "services/physics/contact_pass.hpp"
#include "services/physics/contact_state.hpp"

namespace kilotwin::physics {

class MovablePass {
 public:
  /// A robot that may touch a body within the tick.
  struct Contact {
    Slot robot, point;                  ///< of the robot, and of the touched point
    double normal_x, normal_y, gap_mm;  ///< from the robot, at the tick's start
    double gain, normal_impulse_mm;
    double lever_x_mm, lever_y_mm;  ///< of the touched point from the body's centre
  };

  MovablePass(const RunPlan&, const ContactLimits&);

  /// Gain of the contacts of a body that so many robots may touch.
  [[nodiscard]] double gain(std::uint32_t movable, std::size_t robots) const;

  void clear();
  /// The body is moved in the first so many sub-steps.
  void add(std::uint32_t movable, std::uint32_t passes);
  [[nodiscard]] bool has(std::uint32_t movable) const { return mover_of_[movable] != kNone; }
  [[nodiscard]] bool empty() const { return movers_.empty(); }
  void add_contact(std::uint32_t movable, const Contact& contact) {
    movers_[mover_of_[movable]].contacts.push_back(contact);
  }
  /// Calls take(other) for each movable body that this one may touch within the tick.
  template <class Take>
  void for_each_near(std::uint32_t movable, const std::vector<MovableState>& states, Take&& take) const {
    for (std::uint32_t other = 0; other < states.size(); ++other) {
      const double dx = states[other].x_mm - states[movable].x_mm, dy = states[other].y_mm - states[movable].y_mm;
      const double near_mm = bodies_[other].shape.reach_mm() + bodies_[movable].shape.reach_mm() + range_mm_;
      if (other != movable && dx * dx + dy * dy <= near_mm * near_mm) take(other);
    }
  }

  /// Finds what else the bodies may touch, and gives the touched points their velocities.
  void set_off(const std::vector<MovableState>&, ContactPass&);
  void sub_step(std::uint32_t step, ContactPass&);
  /// Poses and velocities after the tick.
  void finish(std::vector<MovableState>&) const;

 private:
  static constexpr std::uint32_t kNone = 0xffffffffu;

  /// (x, y, rho times the turn).
  struct Motion {
    double x_mm = 0, y_mm = 0, turn_mm = 0;
  };
  /// A point that may touch a wall, an obstacle or another movable body.
  struct Stop {
    double normal_x, normal_y;  ///< out of the body
    double lever_x_mm, lever_y_mm;
    double gap_mm;
    std::uint32_t other;  ///< movable body, or kNone
    double other_lever_x_mm, other_lever_y_mm;
  };
  struct Mover {
    std::uint32_t movable = 0, passes = 0;
    bool linked = false;   ///< it may touch other movers
    bool changed = false;  ///< it is to be braked again
    Motion shift, next_shift, velocity, before;
    Motion braked;  ///< what friction has taken off in this sub-step
    std::vector<Contact> contacts;
    std::vector<Stop> stops;
  };
  /// A point where two movers may touch; normal out of the first. Arms: as of along().
  struct Link {
    std::uint32_t first, second;
    double normal_x, normal_y, first_arm, second_arm, gap_mm;
    double push = 0;  ///< force times the sub-step: kg mm per sub-step
  };

  void find_stops(Mover&, const std::vector<MovableState>&) const;
  void add_stop(Mover&, const MovableState&, double normal_x, double normal_y, double gap_mm, Point2 at,
                std::uint32_t other = kNone, const MovableState* other_state = nullptr) const;
  void find_links();
  void push(Mover&, const ContactPass&) const;
  void balance(std::uint32_t step);
  void brake(Mover&) const;
  [[nodiscard]] double gap_mm(const Mover&, const Stop&) const;
  [[nodiscard]] double room_mm(const Mover&, const Stop&) const;
  /// Takes off what a motion is beyond a limit along a direction.
  static void take(Motion&, double nx, double ny, double arm, double excess);
  void place(Mover&, ContactPass&) const;
  [[nodiscard]] double arm(const Mover& mover, double lever_x_mm, double lever_y_mm, double nx, double ny) const {
    return (lever_x_mm * ny - lever_y_mm * nx) / bodies_[mover.movable].shape.mean_distance_mm();
  }
  void move_points(const Mover&, const Motion& shift, const Motion& swing, double* (ContactPass::*of)(Slot),
                   ContactPass&) const;
  /// Way of the point at this lever along a direction.
  [[nodiscard]] static double along(const Motion& m, double nx, double ny, double arm) {
    return nx * m.x_mm + ny * m.y_mm + arm * m.turn_mm;
  }

  const World world_;
  const std::vector<MovableBodyModel>& bodies_;
  double stride_mm_, touch_mm_, range_mm_, robot_kg_;
  std::vector<double> grip_mm_;  ///< per body: what friction takes off a velocity in a sub-step
  std::vector<std::uint32_t> mover_of_;
  std::vector<Mover> movers_;
  std::vector<Link> links_;
};

}  // namespace kilotwin::physics
