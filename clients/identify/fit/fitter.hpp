/// Fits the model to the tracks of a set: noise by maximum likelihood, everything else by Gauss-Newton steps on the
/// likelihood of the filter's innovations, biases of robots with the distribution of all as their prior.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "clients/identify/fit/linearisation.hpp"
#include "clients/identify/fit/prepared_set.hpp"

namespace kilotwin::identify {

class ScaleHold;

/// Prior standard deviations of the base parameters about the seed's values.
struct BasePrior {
  double straight_mm_s = 1, turn_mm_s = 2, wheel_base_mm = 2, point_mm = 10;
  /// Where nobody knows what the robots were told: anything goes.
  [[nodiscard]] static BasePrior unknown_commands() { return {50, 50, 0.5, 0.1}; }
};

class Fitter {
 public:
  Fitter(PreparedSet& set, std::uint32_t threads) : set_(set), threads_(threads) {
    if (!set.set().has_commands) prior_ = BasePrior::unknown_commands();
  }

  /// All of a model of which nothing is known: walls and what touching does as well.
  void fit_base(MotionModel&) const;
  /// Looks again at walls, discs and what touching does, with effects in the model that had passed for part of it.
  void fit_surroundings(MotionModel&) const;
  /// Fits base, biases, noise and the coefficients of the model's terms. Few passes suffice from a fitted model.
  void fit(MotionModel&, int passes) const;
  /// The noise alone, on some of the tracks.
  void fit_noise(MotionModel&) const;
  /// What touching adds to the motion, likewise.
  void fit_touching(MotionModel&) const;
  /// Where the centre of the disc is, which is what touches, and whether robots touch each other at all; the room.
  void find_shape(MotionModel&) const;
  /// The room, where its walls are not seen because headings are not: walls that make the tracks most likely.
  void find_walls(MotionModel&) const;
  /// Of all that was measured of free robots, on tracks that may be fitted to.
  [[nodiscard]] double log_likelihood(const MotionModel&) const;
  /// Of robots that touch something as well: for models that differ in who does.
  [[nodiscard]] double log_likelihood_of_all(const MotionModel&) const;
  /// Log marginal likelihood over the coefficients of the terms (Laplace's approximation), up to what all models have in common.
  [[nodiscard]] double log_evidence(const MotionModel&) const;
  /// Information and score of the base's prior, added to those of the data.
  void add_base_prior(const MotionModel&, Eigen::MatrixXd& information, Eigen::VectorXd& score) const;
  /// Moves base parameters, terms and biases by a step in all columns.
  static void apply(MotionModel&, const std::vector<Unit>&, const Eigen::VectorXd& step);

  [[nodiscard]] std::uint32_t threads() const { return threads_; }
  [[nodiscard]] PreparedSet& set() const { return set_; }

 private:
  static constexpr std::size_t kEnoughSamples = 8000;  ///< for noise, and for what touching does

  /// One Gauss-Newton step of all but the noise, held back where it would make things worse.
  void step(MotionModel&) const;
  /// Puts a picture straight while nothing is concluded from robots that may touch something: in a picture that is bent walls are
  /// no lines, and robots seem to meet where they do not or to pass through each other.
  void straighten(MotionModel&) const;
  /// That model, but whoever is at the rim or near another may be held.
  [[nodiscard]] MotionModel doubting(MotionModel) const;
  /// Whether what holds robots is not where walls and discs seem to be.
  [[nodiscard]] bool holds_seem_elsewhere(const MotionModel&) const;
  /// Takes walls and discs to be where they now seem to be, if that will do.
  void settle_doubts(MotionModel&) const;
  /// Walls where robots with headings stay at a line.
  void look_for_walls(MotionModel&) const;
  /// Log likelihood of what was measured and of the coefficients beforehand.
  [[nodiscard]] double worth(const MotionModel&) const;
  /// Makes a picture that is put straight as large as robots that touch show it to be. Whether it was not.
  bool set_scale(MotionModel&) const;
  /// Tracks leave the common scale of such a picture's map, speeds and wheel base open: it becomes the most probable one by what
  /// else is known, where steps of a fit that is linear would drift.
  void settle_scale(MotionModel&) const;
  /// Tracks spread over the whole set, until there are so many samples.
  [[nodiscard]] std::vector<const TrackView*> some_tracks(std::size_t samples) const;
  [[nodiscard]] double with_touching(const MotionModel&, const std::vector<const TrackView*>&) const;
  /// What pushes of other robots add up to, as noise of the position; 0 where there are few.
  [[nodiscard]] double lasting_push_mm2_s(const MotionModel&, const std::vector<const TrackView*>&) const;

  PreparedSet& set_;
  std::uint32_t threads_;
  BasePrior prior_;
  /// Where robots touched in the picture: what tells its scale.
  mutable std::shared_ptr<const ScaleHold> hold_;
};

/// How near to each other robots may touch. Without headings nobody sees which way the centre lies from the point that is tracked.
[[nodiscard]] double touching_mm(const BaseParameters&, bool headings);

/// The blocks of all terms of a model, in order.
[[nodiscard]] std::vector<Block> blocks_of(const MotionModel&);

}  // namespace kilotwin::identify
