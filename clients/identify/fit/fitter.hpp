/// Fit of the motion model to the tracks of a set. Noise: maximum likelihood. Base parameters, biases and effects:
/// maximum a posteriori by Gauss-Newton steps on the likelihood of the filter's innovations; the population
/// distribution is the prior of the biases.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "clients/identify/fit/linearisation.hpp"
#include "clients/identify/fit/prepared_set.hpp"

namespace kilotwin::identify {

class ScaleConstraint;

/// Prior standard deviations of the base parameters, about the values of the ARGoS paper.
struct BasePrior {
  double straight_mm_s = 1, turn_mm_s = 2, wheel_base_mm = 2, point_mm = 10;
  /// Sets without commands: a wide prior of the speeds.
  [[nodiscard]] static BasePrior unknown_commands() { return {50, 50, 0.5, 0.1}; }
};

class Fitter {
 public:
  Fitter(PreparedSet& set, std::uint32_t threads) : set_(set), threads_(threads) {
    if (!set.set().has_commands) prior_ = BasePrior::unknown_commands();
  }

  /// Fits everything from default values: base model, walls, disc centre, contact noise.
  void fit_base(MotionModel&) const;
  /// Refits walls, disc centre and contact noise. New effects may explain what looked like contacts.
  void fit_contacts(MotionModel&) const;
  /// Refits base parameters, biases, noise and coefficients. A fitted model needs few passes.
  void fit(MotionModel&, int passes) const;
  /// Refits the noise, on a subset of the tracks.
  void fit_noise(MotionModel&) const;
  /// Refits the contact noise, on a subset of the tracks.
  void fit_contact_noise(MotionModel&) const;
  /// Chooses the disc centre, which is what collides, and whether robots collide with each other. Refits the
  /// walls.
  void fit_disc_centre(MotionModel&) const;
  /// Fits walls by likelihood. Without headings, positions alone do not show them.
  void fit_walls(MotionModel&) const;
  /// Log likelihood of the tracks of the fit, without measurements after contacts.
  [[nodiscard]] double log_likelihood(const MotionModel&) const;
  /// The same with measurements after contacts: for models that differ in the contacts.
  [[nodiscard]] double log_likelihood_of_all(const MotionModel&) const;
  /// Log evidence: the marginal likelihood over the coefficients in Laplace's approximation, up to a constant
  /// common to all models.
  [[nodiscard]] double log_evidence(const MotionModel&) const;
  /// Adds the prior of the base parameters to information and score.
  void add_base_prior(const MotionModel&, Eigen::MatrixXd& information, Eigen::VectorXd& score) const;
  /// Moves base parameters, coefficients and biases by a step in all columns.
  static void apply(MotionModel&, const std::vector<Unit>&, const Eigen::VectorXd& step);

  [[nodiscard]] std::uint32_t threads() const { return threads_; }
  [[nodiscard]] PreparedSet& set() const { return set_; }

 private:
  static constexpr std::size_t kEnoughSamples = 8000;  ///< for noise and contact noise

  /// One damped Gauss-Newton step in everything but the noise.
  void step(MotionModel&) const;
  /// Fits a map of camera distortion without information from contacts. Under distortion walls are not straight,
  /// and encounters are shown in wrong places.
  void fit_camera_distortion(MotionModel&) const;
  /// The model with possible walls along the whole boundary of visited places, and a larger contact range.
  [[nodiscard]] MotionModel with_uncertain_walls(MotionModel) const;
  /// Whether contacts occur away from the model's walls and discs, which indicates distortion.
  [[nodiscard]] bool contacts_contradict_geometry(const MotionModel&) const;
  /// Returns to explicit walls and the normal contact range if they now explain the contacts.
  void resolve_walls(MotionModel&) const;
  /// Updates walls from positions where driven robots accumulate. Needs headings.
  void update_walls(MotionModel&) const;
  /// Log posterior: log likelihood plus log prior of the coefficients.
  [[nodiscard]] double log_posterior(const MotionModel&) const;
  /// Corrects the camera scale by the contact distance. Returns whether it changed.
  bool correct_camera_scale(MotionModel&) const;
  /// Sets the common scale of camera map, speeds and wheel base to its posterior mode. The likelihood is flat
  /// along it, so Gauss-Newton steps would drift.
  void choose_camera_scale(MotionModel&) const;
  /// Tracks spread over the set, up to this number of samples.
  [[nodiscard]] std::vector<const TrackView*> some_tracks(std::size_t samples) const;
  [[nodiscard]] double log_likelihood_with_contacts(const MotionModel&, const std::vector<const TrackView*>&) const;
  /// Variance per second of the displacement by pushes of other robots; 0 if there are few contacts.
  [[nodiscard]] double persistent_push_mm2_s(const MotionModel&, const std::vector<const TrackView*>&) const;

  PreparedSet& set_;
  std::uint32_t threads_;
  BasePrior prior_;
  /// Spans at places of contact, which fix the camera scale.
  mutable std::shared_ptr<const ScaleConstraint> scale_constraint_;
};

/// Contact range, mm. Without headings it allows for the unknown direction of the disc centre.
[[nodiscard]] double contact_range_of(const BaseParameters&, bool headings);

/// The blocks of all terms, in order.
[[nodiscard]] std::vector<Block> blocks_of(const MotionModel&);

}  // namespace kilotwin::identify
