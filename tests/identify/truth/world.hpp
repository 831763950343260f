/// Motion of the robots of a scene: differential drive, discs that push each other, walls, effects.
#pragma once

#include <vector>

#include "tests/identify/truth/dice.hpp"
#include "tests/identify/truth/scene.hpp"

namespace kilotwin::truth {

constexpr double kDiscRadius_mm = 16.5;

/// The point between the wheels, and the heading.
struct Stance {
  Vec axle;
  double heading_rad = 0;
};

/// The wheels that a command drives.
Wheels<bool> driven(Motion motion);

Vec disc_of(const Scene& scene, const Stance& stance);

/// Noise-free measurement of a robot in this situation.
View view_of(const Scene& scene, const Stance& stance, Situation situation);

/// A single robot for `dt`, with factors f of its two wheels.
Stance moved(const Scene& scene, const Individual& individual, const Stance& stance, Situation situation, double dt,
             Wheels<double> factor);

/// Separates overlapping discs and moves them back inside the walls, except `fixed` ones. Returns the
/// displacements in `shift`.
void part(const Scene& scene, std::vector<Stance>& stances, std::vector<Vec>& shift);

/// State of robots and floor other than poses. It follows from orders and tracks.
class Memory {
 public:
  Memory(const Scene& scene, int run, const std::vector<std::vector<Order>>& orders);

  /// Advances to time_s. `discs`: positions since the previous time.
  void go_to(double time_s, const std::vector<Vec>& discs);
  /// The next change of any robot's order; infinity if there is none.
  double next_change_s() const;
  /// A robot's situation now, at `disc`. `discs` and this object must outlive it.
  Situation situation(int robot, Vec disc, double heading_rad, const std::vector<Vec>& discs) const;

 private:
  struct Robot {
    std::size_t next = 0;  // index of the next order
    Motion motion = Motion::kStop, before = Motion::kStop;
    double since_s = 0;
    Wheels<double> driven_s;
    double since_rest_s = 0;
    Motion last_turn = Motion::kStop;
    double before_s = 0;
    int commands = 0;
  };
  /// The robots that drove over a spot last.
  struct Passages {
    int last = -1;                          // robot; -1: none
    float last_s = -1e9F, other_s = -1e9F;  // times of its passage, and of the latest one of another robot
  };
  std::size_t spot(Vec place) const;
  void take_orders();

  const std::vector<std::vector<Order>>* orders_;
  int run_;
  double time_s_ = 0;
  std::vector<Robot> robots_;
  std::vector<Motion> motions_;  // by robot
  double spot_mm_;
  Vec spot_corner_;
  int spots_;                     // along a side of the floor
  std::vector<float> trodden_s_;  // by spot
  std::vector<Passages> passages_;
};

/// All robots of a run.
class World {
 public:
  World(const Scene& scene, const std::vector<Individual>& individuals, Memory memory, std::vector<Stance> stances);

  /// Advances to time_s, in steps of at most the scene's, with factors from `dice`, or 1 without.
  void go_to(double time_s, Dice* dice);
  double time_s() const { return time_s_; }
  const std::vector<Stance>& stances() const { return stances_; }
  View view(int robot) const;
  const Memory& memory() const { return memory_; }
  void start_from(double time_s, const Memory& memory, const std::vector<Stance>& stances);

 private:
  void step(double dt, Dice* dice);

  const Scene& scene_;
  const std::vector<Individual>& individuals_;
  Memory memory_;
  std::vector<Stance> stances_;
  std::vector<Vec> discs_, shift_;
  double time_s_ = 0;
};

}  // namespace kilotwin::truth
