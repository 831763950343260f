/// Causal state estimate of one robot: a bank of extended Kalman filters (a Gaussian sum), one per hypothesis of
/// the initial heading. Without measured headings, 18 evenly spaced hypotheses start and are pruned and merged. They start
/// again where all have lost the track. Once few headings are left, hypotheses of a model with stalls are histories of spells, too.
#pragma once

#include <optional>
#include <vector>

#include "clients/identify/fit/filter_pass.hpp"
#include "clients/identify/fit/spell_branches.hpp"

namespace kilotwin::identify {

class FilterBank {
 public:
  /// Both must outlive the bank.
  FilterBank(const MotionModel& model, const TrackView& view) : model_(&model), view_(&view) {}

  /// Continues under another model of the same robot, which must outlive the bank.
  void take_model(const MotionModel&);
  /// Processes all samples up to this time.
  void advance_to(double to_s);
  [[nodiscard]] bool started() const { return next_ > 0; }
  /// Time of the last processed sample, s.
  [[nodiscard]] double last_s() const { return view_->track->samples[next_ - 1].time_s; }

  struct Hypothesis {
    TrackFilter filter;
    double log_weight = 0;
    std::optional<SpellState> spell = std::nullopt;  ///< none: at random
    double distance2 = 0;                            ///< squared Mahalanobis distance of the last sample
    bool lost = false;                               ///< whether it lost the track there
  };
  [[nodiscard]] const std::vector<Hypothesis>& hypotheses() const { return hypotheses_; }
  [[nodiscard]] const TrackView& view() const { return *view_; }
  /// Of all processed samples.
  [[nodiscard]] double log_likelihood() const { return log_likelihood_; }

 private:
  void take(const Sample&);
  /// Carries a hypothesis to a sample. Returns whether its motion shows spells.
  bool carry(Hypothesis&, const Sample&) const;
  /// Hypotheses of what spells may do up to the sample.
  [[nodiscard]] std::vector<Hypothesis> with_spells(const Sample&) const;
  void start(const Sample&);
  /// Starts anew where the track was lost, at any heading, most likely near the present ones.
  void restart(const Sample&);
  void prune();
  void merge();

  const MotionModel* model_;
  const TrackView* view_;
  std::vector<Hypothesis> hypotheses_;
  std::size_t next_ = 0;
  double log_likelihood_ = 0;
};

/// Disc centres of a track at its sample times. Each uses the samples up to that time only.
[[nodiscard]] Centres centres_of(const MotionModel&, const TrackView&);

}  // namespace kilotwin::identify
