/// Link margins: the propagation model of idl/model.proto. A margin is the received strength in dB above the receiver's
/// threshold.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/model/radio_parameters.hpp"
#include "core/model/ranging.hpp"
#include "core/plan/plan.hpp"
#include "core/random/random.hpp"
#include "services/comm/neighbourhood.hpp"

namespace kilotwin::comm {

/// Draw index of Stream::kReception: the sender's id for its packet, and this value downwards for a tick's overhead packets.
inline constexpr std::uint32_t kLastDraw = (1u << 17) - 1;

/// With models other than PROPAGATION, all robots within radio.range_mm are heard, and margins are meaningless.
class LinkBudget {
 public:
  explicit LinkBudget(const RunPlan&);

  /// Whether distance alone decides which robots hear each other.
  [[nodiscard]] bool is_disc() const { return is_disc_; }
  /// Largest distance at which any robot senses another, mm.
  [[nodiscard]] double reach_mm() const { return reach_mm_; }
  /// Robots within this distance of a sender can affect its links, mm: receivers, and bodies in between.
  [[nodiscard]] double span_mm() const;
  /// Whether bodies attenuate links. If so, sort the neighbourhood before the first margin_db().
  [[nodiscard]] bool casts_shadows() const { return body_loss_db_ > 0; }
  /// Sets a robot's heading. Returns whether links depend on the change.
  bool turn(std::uint32_t robot, double heading_rad) {
    if (!directional_ || heading_rad_[robot] == heading_rad) return false;
    heading_rad_[robot] = heading_rad;
    return true;
  }

  /// Margin of a sender at a receiver, dB, without the noise of single packets. Constant within a run while no robot moves.
  [[nodiscard]] double margin_db(const Neighbourhood&, std::uint32_t sender, std::uint32_t receiver);
  /// Whether the margin is above 0, or, without PROPAGATION, the distance within range.
  [[nodiscard]] bool hears(const Neighbourhood& robots, std::uint32_t receiver, std::uint32_t sender) {
    const double square = robots.square(receiver, sender);
    if (is_disc_) return square <= range_square_ && reaches(robots, receiver, sender);
    if (square <= certain_square_) return true;
    return square <= robots.range_square() && margin_db(robots, sender, receiver) > 0;
  }
  /// Whether two robots within range hear each other, as far as cells of a Kilogrid decide: a cell and the robots above its square
  /// do, two cells do not.
  [[nodiscard]] bool reaches(const Neighbourhood& robots, std::uint32_t a, std::uint32_t b) const {
    return cell_half_mm_.empty() || (cell_half_mm_[a] == 0 && cell_half_mm_[b] == 0) || above_cell(robots, a, b);
  }
  /// Noise of one packet, dB, to be added to the margin. `instant`: start of the packet, which distinguishes packets of a pair.
  [[nodiscard]] double packet_noise_db(std::uint32_t sender, std::uint32_t receiver, std::int64_t instant) const;
  /// Upper bound of a packet's noise, dB.
  [[nodiscard]] double max_packet_noise_db() const { return kMostNoise * packet_sd_db_; }
  [[nodiscard]] double capture_db() const { return capture_db_; }
  /// Carrier sense works down to a margin of minus this value, dB.
  [[nodiscard]] double notice_db() const { return notice_db_; }
  /// A sender with a margin up to this value has no effect on the receiver, dB.
  [[nodiscard]] double floor_db() const {
    return -(notice_db_ > max_packet_noise_db() ? notice_db_ : max_packet_noise_db());
  }
  /// Calibrated readings at this margin, without noise.
  [[nodiscard]] Gains gains(double margin_db) const { return ranging_.gains(range_mm_ - margin_db * mm_per_db_); }
  /// A receiver's readings of a packet that arrives with this margin, with noise.
  [[nodiscard]] Gains readings(std::uint32_t sender, std::uint32_t receiver, std::int64_t instant,
                               double margin_db) const;

 private:
  /// Components along the heading and to its left, or along x and y.
  struct Vector {
    double x, y;
  };
  /// Level as a function of the bearing: c cos(n b) + s sin(n b) for each harmonic n = 1, 2...
  struct Pattern {
    std::vector<Vector> harmonics;
    [[nodiscard]] double amplitude_db() const;
  };
  struct Link {
    std::uint64_t key;
    double offset_db;
  };
  struct Known {
    std::uint32_t other;
    float db;
  };
  static std::uint64_t key(std::uint32_t sender, std::uint32_t receiver) {
    return std::uint64_t{sender} << 32 | receiver;
  }

  [[nodiscard]] bool above_cell(const Neighbourhood&, std::uint32_t a, std::uint32_t b) const;
  void find_reach();
  /// Bound of the random offset of a pair, all parts together.
  [[nodiscard]] double max_spread_db() const;
  void update_facing(std::uint32_t robot);
  [[nodiscard]] double bearing_db(const Pattern&, const RadioParameters::Bearing&, std::uint32_t robot, double x,
                                  double y);
  [[nodiscard]] float spread_db(std::uint32_t sender, std::uint32_t receiver);
  [[nodiscard]] float drawn_spread_db(std::uint32_t sender, std::uint32_t receiver) const;
  /// Sum of the four octets, standardised to mean 0 and standard deviation 1: nearly normal, and bounded.
  static double noise(std::uint32_t bits);
  static constexpr double kMostNoise = 3.4506;  ///< 510 / 147.8

  const RadioParameters robots_;
  const Ranging ranging_;
  const Random random_;
  const bool is_disc_;
  const double range_mm_, range_square_, decay_db_per_mm_, mm_per_db_;
  double body_loss_db_ = 0, link_sd_db_ = 0, pair_sd_db_ = 0, run_sd_db_ = 0, packet_sd_db_ = 0, capture_db_ = 0,
         reading_sd_db_ = 0, notice_db_ = 0;
  bool directional_ = false, sender_matters_ = false, receiver_matters_ = false;
  double reach_mm_, certain_square_;
  Pattern power_pattern_, sensitivity_pattern_;
  std::vector<double> cell_half_mm_;             ///< per robot: half a cell's side, 0 for robots; empty: no cells
  std::vector<Link> links_;                      ///< ascending keys
  std::vector<double> heading_rad_, faced_rad_;  ///< per robot: current heading, and the one of facing_
  std::vector<Vector> facing_;                   ///< per robot: unit vector of its heading
  std::uint32_t row_ = 0;                        ///< entries per receiver in known_
  std::vector<Known> known_;  ///< cache of spread_db() per receiver, by the low bits of the sender
};

}  // namespace kilotwin::comm
