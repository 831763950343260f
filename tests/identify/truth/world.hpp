/// How the robots of a scene move: differential drive, discs that push each other, walls, effects.
#pragma once

#include <vector>

#include "tests/identify/truth/dice.hpp"
#include "tests/identify/truth/scene.hpp"

namespace kilotwin::truth {

constexpr double kDiscRadius_mm = 16.5;

/// The point between the wheels, and where they point to.
struct Stance {
  Vec axle;
  double heading_rad = 0;
};

/// Speeds that the wheels are told to have.
Wheels<double> nominal_mm_s(Motion motion);

Vec disc_of(const Scene& scene, const Stance& stance);

/// What a tracker without noise sees of a robot in this situation.
View view_of(const Scene& scene, const Stance& stance, Situation situation);

/// The robot alone for `dt`, with factors f of its two wheels.
Stance moved(const Scene& scene, const Individual& individual, const Stance& stance, Situation situation, double dt,
             Wheels<double> factor);

/// Parts discs that overlap and takes them back behind the walls, `fixed` ones aside. Returns by how much each robot was
/// moved, in `shift`.
void part(const Scene& scene, std::vector<Stance>& stances, std::vector<Vec>& shift);

/// What robots and the floor remember, apart from where robots are: known to whoever knows the orders and the tracks.
class Memory {
 public:
  Memory(const Scene& scene, int run, const std::vector<std::vector<Order>>& orders);

  /// Goes to time_s, from the time before; discs are where robots were since.
  void go_to(double time_s, const std::vector<Vec>& discs);
  /// The next time after now at which any robot's orders change; infinity where there is none.
  double next_change_s() const;
  /// Robot's situation now, at `disc`. `discs` must outlive it.
  Situation situation(int robot, Vec disc, double heading_rad, const std::vector<Vec>& discs) const;

 private:
  struct Robot {
    std::size_t next = 0;  // order that comes next
    Motion motion = Motion::kStop, before = Motion::kStop;
    double since_s = 0;
    Wheels<double> driven_s;
    double since_rest_s = 0;
  };
  std::size_t spot(Vec place) const;
  void take_orders();

  const std::vector<std::vector<Order>>* orders_;
  int run_;
  double time_s_ = 0;
  std::vector<Robot> robots_;
  double spot_mm_;
  Vec spot_corner_;
  int spots_;                     // along a side of the floor
  std::vector<float> trodden_s_;  // by spot
};

/// All robots of a run together.
class World {
 public:
  World(const Scene& scene, const std::vector<Individual>& individuals, Memory memory, std::vector<Stance> stances);

  /// Goes on to time_s, in steps of at most the scene's, with factors drawn from `dice`, or 1 without.
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
