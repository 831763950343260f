/// How strong each robot's light arrives at each other: the propagation model of idl/model.proto, in dB above what a
/// receiver just hears.
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

/// With a model other than PROPAGATION everybody within radio.range_mm is heard, and margins mean nothing.
class LinkBudget {
 public:
  explicit LinkBudget(const RunPlan&);

  /// Whether the distance alone decides who hears whom.
  [[nodiscard]] bool is_disc() const { return is_disc_; }
  /// Nobody is noticed from farther away, mm.
  [[nodiscard]] double reach_mm() const { return reach_mm_; }
  /// A robot whose pose matters to a link is within this distance of its sender, mm: receivers, and bodies in between.
  [[nodiscard]] double span_mm() const;
  /// Whether bodies cast shadows: then robots must be sorted in the neighbourhood before a margin is asked for.
  [[nodiscard]] bool casts_shadows() const { return body_loss_db_ > 0; }
  /// Whether that matters.
  bool turn(std::uint32_t robot, double heading_rad) {
    if (!directional_ || heading_rad_[robot] == heading_rad) return false;
    heading_rad_[robot] = heading_rad;
    return true;
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
  /// What the noise of a packet adds, dB; `instant` tells the packets of a pair apart. Is asked for where it matters.
  [[nodiscard]] double packet_noise_db(std::uint32_t sender, std::uint32_t receiver, std::int64_t instant) const;
  /// The greatest noise of a packet, dB.
  [[nodiscard]] double most_packet_noise_db() const { return kMostNoise * packet_sd_db_; }
  [[nodiscard]] double capture_db() const { return capture_db_; }
  /// How far below 0 a margin may be for the sender to be noticed, dB.
  [[nodiscard]] double notice_db() const { return notice_db_; }
  /// A robot with a margin up to this is nothing to its receiver, dB.
  [[nodiscard]] double floor_db() const {
    return -(notice_db_ > most_packet_noise_db() ? notice_db_ : most_packet_noise_db());
  }
  /// Readings at this margin, without noise.
  [[nodiscard]] Gains gains(double margin_db) const { return ranging_.gains(range_mm_ - margin_db * mm_per_db_); }
  /// What a receiver reads of a packet that arrives with this margin.
  [[nodiscard]] Gains readings(std::uint32_t sender, std::uint32_t receiver, std::int64_t instant,
                               double margin_db) const;

 private:
  /// Along the heading and to the left of it, or along x and y.
  struct Vector {
    double x, y;
  };
  /// A level over the bearing: c cos + s sin for each harmonic 1, 2...
  struct Pattern {
    std::vector<Vector> harmonics;
    [[nodiscard]] double swing_db() const;
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

  void find_reach();
  /// Bound of what is drawn for a pair, all parts together.
  [[nodiscard]] double most_spread_db() const;
  void face(std::uint32_t robot);
  [[nodiscard]] double bearing_db(const Pattern&, const RadioParameters::Bearing&, std::uint32_t robot, double x,
                                  double y);
  [[nodiscard]] float spread_db(std::uint32_t sender, std::uint32_t receiver);
  [[nodiscard]] float drawn_spread_db(std::uint32_t sender, std::uint32_t receiver) const;
  /// Sum of the four octets, with mean 0 and standard deviation 1: near enough to normal, and bounded.
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
  double reach_mm_, surely_square_;
  Pattern power_pattern_, sensitivity_pattern_;
  std::vector<Link> links_;                      ///< ascending keys
  std::vector<double> heading_rad_, faced_rad_;  ///< per robot: now, and for which facing_ holds
  std::vector<Vector> facing_;                   ///< per robot: unit vector of its heading
  std::uint32_t row_ = 0;                        ///< entries per receiver in known_
  std::vector<Known> known_;  ///< per receiver: what spread_db has found, by the low bits of the sender
};

}  // namespace kilotwin::comm
