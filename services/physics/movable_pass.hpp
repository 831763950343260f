/// The Jacobi passes of a tick over movable bodies: rigid and convex, with dry friction on the floor. contact.hpp states the
/// method.
///
/// A velocity is (vx, vy, rho w), with rho the mean distance of the base area from its centre. Dry friction limits force
/// and moment to the ellipsoid |f|^2 + (M / rho)^2 <= (friction m g)^2: the limit surface of Howe and Cutkosky (1996). Its
/// two axes are exact for an evenly distributed weight. The moment of inertia is taken as m rho^2, so that friction
/// shortens the velocity vector in these coordinates. It matters only during an impact.
///
/// Forces between movable bodies are solved in each sub-step together with friction, for all bodies that can touch each
/// other (projected Gauss-Seidel with over-relaxation, in ascending order). So forces pass through any chain of bodies
/// within the sub-step, and such bodies together form one hop.
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
  /// A contact with a robot that is possible within the tick.
  struct Contact {
    Slot robot, point;                  ///< slots of the robot and of the point of contact on the body
    double normal_x, normal_y, gap_mm;  ///< normal from the robot; both at the tick's start
    double gain, normal_impulse_mm;
    double lever_x_mm, lever_y_mm;  ///< from the body's centre to the point of contact
  };

  MovablePass(const RunPlan&, const ContactLimits&);

  /// Gain of the contacts of a body that this many robots may touch.
  [[nodiscard]] double gain(std::uint32_t movable, std::size_t robots) const;

  void clear();
  /// Adds a body that moves in the first `passes` sub-steps.
  void add(std::uint32_t movable, std::uint32_t passes);
  [[nodiscard]] bool has(std::uint32_t movable) const { return mover_of_[movable] != kNone; }
  [[nodiscard]] bool empty() const { return movers_.empty(); }
  void add_contact(std::uint32_t movable, const Contact& contact) {
    movers_[mover_of_[movable]].contacts.push_back(contact);
  }
  /// Calls take(other) for each movable body that `movable` may touch within the tick.
  template <class Take>
  void for_each_near(std::uint32_t movable, const std::vector<MovableState>& states, Take&& take) const {
    for (std::uint32_t other = 0; other < states.size(); ++other) {
      const double dx = states[other].x_mm - states[movable].x_mm, dy = states[other].y_mm - states[movable].y_mm;
      const double near_mm = bodies_[other].shape.reach_mm() + bodies_[movable].shape.reach_mm() + range_mm_;
      if (other != movable && dx * dx + dy * dy <= near_mm * near_mm) take(other);
    }
  }

  /// Finds the bodies' contacts with walls, obstacles and each other, and writes the velocities of the points of contact.
  void start(const std::vector<MovableState>&, ContactPass&);
  void sub_step(std::uint32_t step, ContactPass&);
  /// Poses and velocities after the tick.
  void finish(std::vector<MovableState>&) const;

 private:
  static constexpr std::uint32_t kNone = 0xffffffffu;

  /// Translation x, y and rho times the turn, or their rates per sub-step.
  struct Motion {
    double x_mm = 0, y_mm = 0, turn_mm = 0;
  };
  /// A possible contact with a wall, an obstacle or another movable body.
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
    bool changed = false;  ///< balance() must apply friction again
    Motion shift, next_shift, velocity, before;
    Motion braked;  ///< velocity that friction has removed in this sub-step
    std::vector<Contact> contacts;
    std::vector<Stop> stops;
  };
  /// A possible contact of two movers. The normal points out of the first. Arms: as for along().
  struct Link {
    std::uint32_t first, second;
    double normal_x, normal_y, first_arm, second_arm, gap_mm;
    double push = 0;  ///< impulse, kg mm per sub-step
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
  /// Removes the excess of a motion beyond a limit along a direction.
  static void remove_excess(Motion&, double nx, double ny, double arm, double excess);
  void place(Mover&, ContactPass&) const;
  [[nodiscard]] double arm(const Mover& mover, double lever_x_mm, double lever_y_mm, double nx, double ny) const {
    return (lever_x_mm * ny - lever_y_mm * nx) / bodies_[mover.movable].shape.mean_distance_mm();
  }
  void move_points(const Mover&, const Motion& shift, const Motion& extrapolated, double* (ContactPass::*of)(Slot),
                   ContactPass&) const;
  /// Displacement of a point along a direction. `arm`: as arm() returns it.
  [[nodiscard]] static double along(const Motion& m, double nx, double ny, double arm) {
    return nx * m.x_mm + ny * m.y_mm + arm * m.turn_mm;
  }

  const World world_;
  const std::vector<MovableBodyModel>& bodies_;
  double stride_mm_, touch_mm_, range_mm_, robot_kg_;
  std::vector<double> grip_mm_;  ///< per body: velocity that friction can remove in a sub-step
  std::vector<std::uint32_t> mover_of_;
  std::vector<Mover> movers_;
  std::vector<Link> links_;
};

}  // namespace kilotwin::physics
