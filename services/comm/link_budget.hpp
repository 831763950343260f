/// How strong each robot's light arrives at each other: the propagation model of idl/model.proto, in dB above what a
/// receiver just hears.
#pragma once

#include <cstdint>
#include <vector>

#include "core/experiment/plan.hpp"
#include "core/random/random.hpp"
#include "services/comm/neighbourhood.hpp"

namespace kilotwin::comm {

/// Where the experiment has no propagation model, everybody within radio.range_mm is heard, and margins mean nothing.
class LinkBudget {
 public:
  explicit LinkBudget(const RunPlan&);

  /// Whether the distance alone decides who hears whom.
  [[nodiscard]] bool is_disc() const { return is_disc_; }
  /// Nobody is heard from farther away, mm.
  [[nodiscard]] double reach_mm() const { return reach_mm_; }
  /// Whether bodies cast shadows: then robots must be sorted in the neighbourhood before a margin is asked for.
  [[nodiscard]] bool casts_shadows() const { return body_loss_db_ > 0; }
  void turn(std::uint32_t robot, double heading_rad) {
    if (directional_) heading_rad_[robot] = heading_rad;
  }

  /// Margin of a sender at a receiver, dB, that stays for a run while nobody moves: without the noise of a packet.
  [[nodiscard]] double margin_db(const Neighbourhood&, std::uint32_t sender, std::uint32_t receiver);
  /// Whether that margin is above 0.
  [[nodiscard]] bool hears(const Neighbourhood& robots, std::uint32_t receiver, std::uint32_t sender) {
    const double square = robots.square(receiver, sender);
    if (is_disc_) return square <= range_square_;
    if (square <= surely_square_) return true;
    return square <= robots.range_square() && margin_db(robots, sender, receiver) > 0;
  }
  /// What the noise of a packet adds, dB.
  [[nodiscard]] double packet_noise_db(std::uint32_t sender, std::uint32_t receiver, Tick now) const;
  [[nodiscard]] double capture_db() const { return capture_db_; }
  /// The distance at which the nominal robot is heard with this margin, mm.
  [[nodiscard]] double distance_of_mm(double margin_db) const { return range_mm_ - margin_db / decay_db_per_mm_; }

 private:
  /// A component ahead and one to the left, of one robot, or along x and y.
  struct Vector {
    double x = 0, y = 0;
  };
  struct Link {
    std::uint64_t key;
    double offset_db;
  };
  static std::uint64_t key(std::uint32_t sender, std::uint32_t receiver) {
    return std::uint64_t{sender} << 32 | receiver;
  }

  void draw_robots(const proto::Propagation&, std::uint32_t robots);
  void note_known(const proto::Propagation&, std::uint32_t robots);
  void find_reach();
  /// Turns what depends on the bearing into the arena's frame.
  void orient(std::uint32_t robot);
  /// Sum of eight uniform numbers, with mean 0 and standard deviation 1: near enough to normal, and bounded.
  [[nodiscard]] double noise(Stream, std::uint32_t entity, Tick, std::uint32_t block) const;
  static constexpr double kMostNoise = 4.898979485566356;  ///< 4 / sqrt(8 / 12)

  Random random_;
  bool is_disc_, directional_ = false;
  double range_mm_, range_square_, decay_db_per_mm_, body_loss_db_ = 0, link_sd_db_ = 0, packet_sd_db_ = 0,
                                                     capture_db_ = 0;
  double reach_mm_ = 0, surely_square_ = 0;
  std::vector<double> power_db_, sensitivity_db_;              ///< per robot
  std::vector<Vector> power_bearing_, sensitivity_bearing_;    ///< per robot, in its own frame, dB
  std::vector<Link> links_;                                    ///< ascending keys
  std::vector<double> heading_rad_, oriented_rad_;             ///< per robot: now, and for which the next two hold
  std::vector<Vector> power_in_arena_, sensitivity_in_arena_;  ///< per robot
};

}  // namespace kilotwin::comm
