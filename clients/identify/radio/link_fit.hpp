/// Who hears whom, estimated from runs: the terms of the propagation model as a Gaussian prior over the margins of all links, a
/// link being on in a run where its margin and that run's noise are above 0 (probit). Spreads by expectation-maximisation
/// about the mode (Laplace's approximation).
#pragma once

#include <Eigen/Dense>
#include <string>
#include <vector>

#include "clients/identify/radio/grid_data.hpp"
#include "idl/experiment.pb.h"

namespace kilotwin::radio_fit {

/// Which terms the model has; each includes the ones above it.
enum class Terms { kDistance, kPattern, kLaying, kBodies, kRobots, kBearings, kPairs };

struct LinkModel {
  Terms terms = Terms::kDistance;
  double range_mm = 130;
  std::vector<double> pattern_db;  ///< a1 b1 a2 b2..
  double body_loss_db = 0, laying_sd_db = 0;
  double power_sd_db = 0, sensitivity_sd_db = 0, power_bearing_sd_db = 0, sensitivity_bearing_sd_db = 0;
  double pair_sd_db = 0, link_sd_db = 0;
  /// Of one set: its robots and links, and what changes from run to run.
  struct Swarm {
    std::string set;
    double run_sd_db = 1;
    std::vector<double> pattern_db;  ///< the common one and what is this set's own
    Eigen::VectorXd power_db, sensitivity_db;
    Eigen::MatrixXd power_bearing_db, sensitivity_bearing_db;  ///< robots x 2: ahead, left
    Eigen::MatrixXd link_db;                                   ///< receiver, sender
    Eigen::MatrixXd margin_db;                                 ///< likewise: all terms together
  };
  std::vector<Swarm> swarms;

  /// What is not of links.
  struct Timing {
    double packet_sd_db = 0.15, notice_db = 0, oscillator_sd = 0.005;
    Eigen::VectorXd oscillator;  ///< per robot, where known; else empty
  };

  /// For the runs of one set, with its robots.
  [[nodiscard]] proto::Radio radio(const Swarm& swarm, const Timing& timing) const;
  /// Robots and links drawn; what changes from run to run is as in `swarm`.
  [[nodiscard]] proto::Radio population(const Swarm& swarm, const Timing& timing) const;
};

/// Harmonics of the pattern.
inline constexpr int kHarmonics = 8;
/// Distances between which links are neither all heard nor all silent, and from which on links are fitted to, mm.
inline constexpr double kSurelyHeard_mm = 105, kNeverHeard_mm = 200, kFitted_mm = 95;

/// How much of the line between two robots lies within others, in diameters.
[[nodiscard]] double bodies_between(const GridSet& set, int a, int b);

/// Share of the runs in which each link was on, receiver by sender; below 0 where nothing is known.
[[nodiscard]] Eigen::MatrixXd on_share(const GridSet& set);

/// Range, pattern and spreads are common to the sets; robots, links and the noise of runs are each set's own.
[[nodiscard]] LinkModel fit_links(const std::vector<GridSet>& sets, Terms terms);

}  // namespace kilotwin::radio_fit
