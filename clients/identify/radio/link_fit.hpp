/// Link model: a Gaussian prior over the margins of all links with a probit observation model. A link is on in a
/// run if margin plus the run's noise exceeds 0. Variances by expectation maximisation about the mode (Laplace
/// approximation).
#pragma once

#include <Eigen/Dense>
#include <string>
#include <vector>

#include "clients/identify/radio/grid_data.hpp"
#include "idl/experiment.pb.h"

namespace kilotwin::radio_fit {

/// Nested models: each includes the previous terms.
enum class Terms { kDistance, kPattern, kPlacement, kBodies, kRobots, kBearings, kPairs };

/// The harmonic of a number of a pattern a1 b1 a2 b2..
[[nodiscard]] constexpr std::size_t harmonic_of(std::size_t number) { return number / 2 + 1; }

struct LinkModel {
  Terms terms = Terms::kDistance;
  double range_mm = 130;
  std::vector<double> pattern_db;  ///< a1 b1 a2 b2..
  double body_loss_db = 0, laying_sd_db = 0;
  double power_sd_db = 0, sensitivity_sd_db = 0, power_bearing_sd_db = 0, sensitivity_bearing_sd_db = 0;
  double pair_sd_db = 0, link_sd_db = 0;
  /// Robots and links of one set, and the noise of its runs.
  struct Swarm {
    std::string set;
    double run_sd_db = 1;
    std::vector<double> pattern_db;  ///< common pattern plus the set's own
    Eigen::VectorXd power_db, sensitivity_db;
    Eigen::MatrixXd power_bearing_db, sensitivity_bearing_db;  ///< robots x 2: ahead, left
    Eigen::MatrixXd link_db;                                   ///< receiver x sender
    Eigen::MatrixXd margin_db;                                 ///< receiver x sender: sum of all terms
  };
  std::vector<Swarm> swarms;

  /// Parameters other than links.
  struct Timing {
    double packet_sd_db = 0.15, notice_db = 0, oscillator_sd = 0.005;
    Eigen::VectorXd oscillator;  ///< per robot if known, else empty
  };

  /// Radio model for a set, with its robots.
  [[nodiscard]] proto::Radio radio(const Swarm& swarm, const Timing& timing) const;
  /// Radio model with random robots and links. The noise of runs is that of `swarm`.
  [[nodiscard]] proto::Radio population(const Swarm& swarm, const Timing& timing) const;
};

/// Harmonics of the pattern.
inline constexpr int kHarmonics = 8;
/// Distances, mm: below the first all links are on, beyond the second none is; links are fitted from the third on.
inline constexpr double kSurelyHeard_mm = 105, kNeverHeard_mm = 200, kFitted_mm = 95;

/// Length of the line between two robots that other robots cover, in diameters.
[[nodiscard]] double bodies_between(const GridSet& set, int a, int b);

/// Share of runs in which each link was on, receiver x sender; below 0 if unknown.
[[nodiscard]] Eigen::MatrixXd on_share(const GridSet& set);

/// Range, pattern and variances are common to all sets. Robots, links and noise of runs belong to each set.
[[nodiscard]] LinkModel fit_links(const std::vector<GridSet>& sets, Terms terms);

}  // namespace kilotwin::radio_fit
