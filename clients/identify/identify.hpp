/// The measured-data loop: why robots differ from the model, put into the model. Pure: sets in, one document out.
///
/// The document holds everything that the report shows. Its keys (lengths mm, times s, angles rad; any list may be empty):
///   contract      result.json: before, after {rmse_mm, rmse_low_mm, rmse_high_mm, rows}, improvement {less_by_mm, low_mm, high_mm,
///                 bounds_how}, noise_floor_mm, noise_floor_how, replicates {floor_mm, repeatable_mm, groups, windows},
///                 horizon_s, effects, base, noise, rejected, ambiguous, faults, simulated (simulated_check.hpp)
///     effects     [{name, covariates [..], acts_on, evidence {log10_p, p_family, log_likelihood_gain, held_out_gain,
///                 held_out_gain_se, degrees}, parameters {form, ...}, rmse_without_mm, share_removed, in_words}], strongest first
///     rejected    [{name, covariates, acts_on, log10_p, threshold_log10_p}]: the strongest of what was tried and not added
///     ambiguous   [{found, instead, log_likelihood_difference, experiment}]: causes that this data cannot tell apart
///     faults      [{kind, run, robot, from_s, to_s, in_words}]: of the data; excluded
///   set           {train, test, runs, robots, tracks, samples, has_headings, has_commands, duration_s, sample_s, held_out}
///   robots        [{robot, bias_left_mm_s, bias_right_mm_s, sd_left_mm_s, sd_right_mm_s, before_mm, after_mm}]
///   horizon       {at_s [..], before_mm [..], after_mm [..], floor_mm [..]}: rms error over how far ahead
///   covariate_plots [{target, covariate, unit, acts_on_unit, at [..], before [..], before_se [..], after [..], fitted [..]}]:
///                 means of the disturbances (target: forward, turn, world_x, world_y, measured_x, measured_y) over bins
///                 of one covariate; `fitted` (null where nothing was) is the effect as added
///   maps          [{target, unit, x_mm [..], y_mm [..], before [[..]..], after [[..]..], count [[..]..]}]: rows are y
///   effect_curves [{name, which, covariate, unit, acts_on, acts_on_unit, at [..], value [..]}]: effects as they were written
///   effect_maps   [{name, which, acts_on, unit, x_mm [..], y_mm [..], effect [[..]..]}]: those that depend on the place
///   distributions [{name, unit, edges [..], measured [..], base [..], simulated [..]}]: counts; `base` by the base model
///   msd           {lag_s [..], measured_mm2 [..], base_mm2 [..], simulated_mm2 [..]}
///   speed_over_time {time_s [..], measured_mm_s [..], base_mm_s [..], simulated_mm_s [..]}: means
///   steps         [{added, rmse_mm, held_out_gain}]: the loop, in order
///   headline, verdict, summary [..]  words in place of the page's own and of what the command says at its end; absent: those
///   bars          [{kind, name, value, low, high, unit, from}] in place of the errors' bars
///   tables        [{id, title, lead, head [..], rows [[..]..]}], each a section; an effect's `facts` [[name, value]..] likewise
///   seconds       wall time of each part, for the screen only
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
  bool trace = true;  ///< false: the base model alone
  /// How far the work is, 0..1, and what is being done.
  std::function<void(double, const std::string&)> progress;
};

struct Identified {
  proto::Model model;  ///< `kilotwin run --model` simulates with it
  nlohmann::json document;
  std::vector<Prediction> predictions;
};

/// Fits to the tracks of `train` that are not held out. Predicts `test`; null: the tracks of `train` that are held out.
[[nodiscard]] Identified identify(const MeasuredSet& train, const MeasuredSet* test, const Options&);

/// Holds out about a quarter: the last runs where there are three or more, else some of the robots, else the last part of the tracks.
void hold_out_part(MeasuredSet&);

}  // namespace kilotwin::identify
