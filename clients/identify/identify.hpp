/// Identification from trajectories: estimates why robots deviate from the base model, and extends the model by
/// effects. A pure function from measured sets to a model and a document.
///
/// The document contains everything that the report shows. Its keys (lengths mm, times s, angles rad; lists may be
/// empty):
///   contract      result.json: before, after {rmse_mm, rmse_low_mm, rmse_high_mm, rows}, improvement {less_by_mm,
///                 low_mm, high_mm, bounds_how}, held_out {kind, in_words}, noise_floor_mm, noise_floor_how, replicates
///                 {floor_mm, repeatable_mm, groups, windows}, horizon_s, effects, base, noise, walls, rejected,
///                 ambiguous, faults, simulated (replay/simulation_check.hpp). All errors are of held-out data; if
///                 nothing is held out they are null
///     next        the most useful thing to do next, as one sentence
///     check       {path [{effects [..], rmse_mm}], kept, dropped [..], in_words}: the last check (last_check.hpp);
///                 `in_words`: what a reader must know about the errors and the search, absent if nothing
///     search      {work (fit/prepared_set.hpp), limit (a sentence, empty if the search ended by itself)}
///     unexplained {large, systematic_mm, share, expected_mm, repetitions_mm, learner {error_mm, error_left_mm,
///                 less_by_low_mm, less_by_high_mm, cross_validated}, patterns [{covariates [..], units [..], components
///                 [..], share, at [..], and_at [..], first_mm [and_at][at], second_mm}], in_words}: what the model
///                 leaves unexplained (unexplained/unexplained.hpp)
///     effects     [{name, covariates [..], acts_on, evidence {log10_p, threshold_log10_p, p_family, log_likelihood_gain,
///                 held_out_gain, held_out_gain_se, degrees}, parameters {form, ...}, rmse_without_mm, share_removed,
///                 in_words}], strongest first
///     rejected    [{name, covariates, acts_on, log10_p, threshold_log10_p, why}]: most significant hypotheses not accepted
///     ambiguous   [{found, instead, log_likelihood_difference, experiment}]: effects not identifiable separately
///     faults      [{kind, run, robot, from_s, to_s, in_words}]: faults of the data, excluded from the fit
///   set           {train, test, runs, robots, tracks, samples, has_headings, has_commands, duration_s, sample_s, held_out}
///   robots        [{robot, bias_left_mm_s, bias_right_mm_s, sd_left_mm_s, sd_right_mm_s, before_mm, after_mm}]
///   horizon       {at_s [..], before_mm [..], after_mm [..], floor_mm [..]}: rms error over the horizon
///   covariate_plots [{target, covariate, unit, acts_on_unit, at [..], before [..], before_se [..], after [..],
///                 fitted [..]}]: mean disturbances (target: forward, turn, world_x, world_y, measured_x, measured_y)
///                 over bins of one covariate; `fitted`: the effect in the model, null if there is none
///   maps          [{target, unit, x_mm [..], y_mm [..], before [y][x], after [y][x], count [y][x]}]
///   effect_curves [{name, which, covariate, unit, acts_on, acts_on_unit, at [..], value [..]}]: fitted curves
///   effect_maps   [{name, which, acts_on, unit, x_mm [..], y_mm [..], effect [y][x]}]: fitted maps
///   distributions [{name, unit, edges [..], measured [..], base [..], simulated [..]}]: counts; `base`: base model
///   msd           {lag_s [..], measured_mm2 [..], base_mm2 [..], simulated_mm2 [..]}
///   speed_over_time {time_s [..], measured_mm_s [..], base_mm_s [..], simulated_mm_s [..]}: means
///   steps         [{added, rmse_mm, held_out_gain}]: accepted effects in order
///   headline, verdict, summary [..]  replace the page's own text and the command's last lines; absent: those
///   bars          [{kind, name, value, low, high, unit, from}] replace the error bars
///   tables        [{id, title, lead, head [..], rows [[..]..]}], one section each; likewise `facts` of an effect
///   seconds       wall time of each part, for the terminal only
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "clients/identify/data/measured_set.hpp"
#include "clients/identify/predict/prediction.hpp"
#include "idl/model.pb.h"

namespace kilotwin::identify {

struct Options {
  double horizon_s = 10;
  std::uint32_t threads = 2;
  bool find_effects = true;  ///< false: the base model only
  std::uint32_t draws = 0;   ///< models from the posterior; their values may lie outside the ranges of a model file
  /// Where the caller will write the model: for the text of the result.
  std::string model_file = "model.txtpb";
  /// Progress, 0..1, and the present step.
  std::function<void(double, const std::string&)> progress;
};

struct Identified {
  proto::Model model;  ///< input of `kilotwin run --model`
  nlohmann::json document;
  std::vector<Prediction> predictions;
  std::vector<proto::Model> draws;
};

/// Fits the tracks of `train` that are not held out. Predicts `test`; null: the held-out tracks of `train`.
[[nodiscard]] Identified identify(const MeasuredSet& train, const MeasuredSet* test, const Options&);

}  // namespace kilotwin::identify
