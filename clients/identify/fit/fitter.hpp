/// Fit of the motion model to the tracks of a set. Noise: maximum likelihood. Base parameters, biases and effects:
/// maximum a posteriori by Gauss-Newton steps on the likelihood of the filter's innovations; the population
/// distribution is the prior of the biases.
///
/// The fitter itself never changes: every function reads or changes the state that it is given.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <utility>
#include <vector>

#include "clients/identify/fit/fit_state.hpp"
#include "clients/identify/fit/linearisation.hpp"
#include "clients/identify/fit/noise_fit.hpp"

namespace kilotwin::identify {

/// Prior standard deviations of the base parameters, about the values of the ARGoS paper.
struct BasePrior {
  double straight_mm_s = 1, turn_mm_s = 2, wheel_base_mm = 2, point_mm = 10;
  /// Sets without commands: a wide prior of the speeds.
  [[nodiscard]] static BasePrior unknown_commands() { return {50, 50, 0.5, 0.1}; }
};

class Fitter {
 public:
  Fitter(const MeasuredSet& set, std::uint32_t threads)
      : headings_(set.has_headings),
        threads_(threads),
        prior_(set.has_commands ? BasePrior{} : BasePrior::unknown_commands()) {}

  /// Fits everything from default values: base model, walls, disc centre, contact noise.
  void fit_base(FitState&) const;
  /// Refits walls, disc centre and contact noise. New effects may explain what looked like contacts.
  void fit_contacts(FitState&) const;
  /// Refits base parameters, biases, noise and coefficients. A fitted model needs few passes.
  void fit(FitState&, int passes) const;
  /// The same. Returns the log_likelihood() of the result, which the last step knows in most cases.
  double fit_for_likelihood(FitState&, int passes) const;
  /// The same until the likelihood hardly rises: for a term in place of another, which may change everything.
  void fit_until_settled(FitState&) const;
  /// Refits the noise, on a subset of the tracks.
  void fit_noise(FitState&) const;
  /// Refits the contact noise, on a subset of the tracks.
  void fit_contact_noise(FitState&) const;
  /// Chooses the disc centre, which is what collides, and whether robots collide with each other. Refits the
  /// walls.
  void fit_disc_centre(FitState&) const;
  /// Fits walls by likelihood. Without headings, positions alone do not show them.
  void fit_walls(FitState&) const;
  /// Sets the lag between the stamps of commands and the robots' motion to its most likely value. That value must be
  /// more likely than the present one by a clear margin, and by `least_gain`. Returns the gain in log likelihood of all tracks, 0 without
  /// a change.
  double fit_command_lag(FitState&, double least_gain = 0) const;
  /// Log likelihood of the tracks of the fit, without measurements after contacts.
  [[nodiscard]] double log_likelihood(const FitState&) const;
  /// The same with measurements after contacts: for models that differ in the contacts.
  [[nodiscard]] double log_likelihood_of_all(const FitState&) const;
  /// Log evidence: the marginal likelihood over the coefficients in Laplace's approximation, up to a constant
  /// common to all models.
  [[nodiscard]] double log_evidence(const FitState&) const;
  /// Information of base parameters and coefficients, with their priors. The biases are eliminated.
  [[nodiscard]] Eigen::MatrixXd information(const FitState&) const;
  /// Adds the prior of the base parameters to information and score.
  void add_base_prior(const MotionModel&, Eigen::MatrixXd& information, Eigen::VectorXd& score) const;
  /// Moves base parameters, coefficients and biases by a step in all columns.
  static void apply(MotionModel&, const std::vector<Unit>&, const Eigen::VectorXd& step);

  /// 95 % intervals of the fitted noise by profile likelihood, on the tracks by which fit_noise() fits it.
  [[nodiscard]] NoiseInterval noise_interval(const FitState&) const;
  /// 95 % interval of the fitted lag of the commands by profile likelihood: low, high.
  [[nodiscard]] std::pair<double, double> command_lag_interval(const FitState&) const;

  /// The mean of the biases has a prior: as if so many biases with the value of the ARGoS paper had been measured.
  static constexpr double kPriorBiases = 4;

  [[nodiscard]] std::uint32_t threads() const { return threads_; }

 private:
  static constexpr std::size_t kEnoughSamples = 8000;  ///< for noise and contact noise

  /// The prior of the base parameters beside the model's terms. Its speeds are nominal ones. The curve of an effect on the speed
  /// leaves open at which values of its covariate they hold: `by_effects` is the standard deviation of the speed there, relative.
  [[nodiscard]] BasePrior prior_beside(const MotionModel&, double by_effects) const;
  /// fit(); returns the log likelihood if the last step knows it.
  std::optional<double> fit_passes(FitState&, int passes) const;
  /// One damped Gauss-Newton step in everything but the noise. Returns the log likelihood of the result if it knows it.
  std::optional<double> step(FitState&) const;
  /// Fits a map of camera distortion without information from contacts. Under distortion walls are not straight,
  /// and encounters are shown in wrong places.
  void fit_camera_distortion(FitState&) const;
  /// Possible walls along the whole boundary of visited places, and a larger contact range.
  static void set_uncertain_walls(MotionModel&);
  /// Whether contacts occur away from the model's walls and discs, which indicates distortion.
  [[nodiscard]] bool contacts_contradict_geometry(const FitState&) const;
  /// Returns to explicit walls and the normal contact range if they now explain the contacts.
  void resolve_walls(FitState&) const;
  /// Updates walls from positions where driven robots accumulate. Needs headings.
  void update_walls(FitState&) const;
  /// Corrects the camera scale by the contact distance. Returns whether it changed.
  static bool correct_camera_scale(FitState&);
  /// Sets the common scale of camera map, speeds and wheel base to its posterior mode. The likelihood is flat
  /// along it, so Gauss-Newton steps would drift.
  void choose_camera_scale(FitState&) const;
  [[nodiscard]] double log_likelihood_with_contacts(const MotionModel&, const std::vector<const TrackView*>&) const;
  /// Variance per second of the displacement by pushes of other robots; 0 if there are few contacts.
  [[nodiscard]] double persistent_push_mm2_s(const MotionModel&, const std::vector<const TrackView*>&) const;

  bool headings_;  ///< whether the set has any
  std::uint32_t threads_;
  BasePrior prior_;
};

/// Contact range, mm. Without headings it allows for the unknown direction of the disc centre.
[[nodiscard]] double contact_range_of(const BaseParameters&, bool headings);

/// The blocks of all terms, in order.
[[nodiscard]] std::vector<Block> blocks_of(const MotionModel&);

}  // namespace kilotwin::identify
