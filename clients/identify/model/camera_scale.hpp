/// Scale of a camera whose distortion is fitted. Tracks leave the scale undetermined: a larger image means faster
/// robots. Known lengths determine it: the centres of two robots in contact are one disc diameter (33 mm) apart.
#pragma once

#include <optional>
#include <vector>

#include "clients/identify/model/motion_model.hpp"
#include "clients/identify/model/neighbours.hpp"

namespace kilotwin::identify {

/// Distance between the centres of robots in contact, estimated from all pairs.
struct ContactDistance {
  double mm = 0, sd_mm = 0;    ///< mean and standard error, with the tolerance of disc diameters
  std::size_t encounters = 0;  ///< number of encounters: two robots of one run, at one occasion
};

/// Two robots at one instant.
struct RobotPair {
  double distance_mm = 0;
  std::size_t encounter = 0;  ///< index of the encounter: instants of one encounter are not independent
  double x_mm = 0, y_mm = 0;  ///< midpoint
  Situation at;               ///< time and run
};

/// Estimates the contact distance as the lower edge of the distribution of pair distances, where robots in contact
/// accumulate. Nothing if the data do not show an edge.
[[nodiscard]] std::optional<ContactDistance> contact_distance(const std::vector<RobotPair>&);

/// Appends all pairs of a run that came near each other; `number` is that of the run.
void add_pairs(const RunNeighbours&, std::size_t robots, std::uint32_t number, std::vector<RobotPair>& to);

/// Constraint on the scale of a camera map during a refit: a set of spans in the image keeps its mean length in
/// the world.
class ScaleConstraint {
 public:
  /// Spans around the places where pairs met. `relative_sd`: standard deviation of the constraint.
  ScaleConstraint(const MotionModel&, const std::vector<RobotPair>&, double relative_sd);
  [[nodiscard]] double relative_sd() const { return relative_sd_; }
  /// Factor by which all lengths in the world must grow to restore the constraint.
  [[nodiscard]] double factor(const MotionModel&) const;

 private:
  struct Span {
    Situation at;
    double x_mm[2], y_mm[2];  ///< end points in the image
  };
  [[nodiscard]] double log_length(const MotionModel&) const;  ///< mean over all spans
  std::vector<Span> spans_;
  double then_ = 0, relative_sd_ = 0;
};

/// Maps the walls of `before` into the camera model of `after`, so that the camera sees them at the same places.
[[nodiscard]] Walls carried(const Walls&, const MotionModel& before, const MotionModel& after);

/// Scales all lengths in the world by `factor` about the middle of the camera map, and leaves the image unchanged.
/// False, without a change, if the model has no camera map that can compensate for it.
bool rescale(MotionModel&, double factor);
/// Derivative of the logarithm of the camera scale by each coefficient of all terms, in order. Empty if the model
/// has no such map.
/// it has no such map.
[[nodiscard]] Eigen::VectorXd log_scale_by_coefficients(const MotionModel&);

}  // namespace kilotwin::identify
