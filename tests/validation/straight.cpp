#include <fmt/format.h>

#include <array>
#include <cmath>

#include "clients/report/plot.hpp"
#include "core/stats/moments.hpp"
#include "tests/validation/reference.hpp"
#include "tests/validation/straight_theory.hpp"
#include "tests/validation/validations.hpp"

namespace kilotwin::validation {
namespace {

/// Of the recorded states, at 0, 1, 2... s, the first by which everybody drives: displacements are counted from there, and
/// nothing depends on how a run starts.
constexpr std::size_t kFirstState = 1;

std::string seeds(int count) { return fmt::format("1..{}", count); }

}  // namespace

void validate_bias(Runs& runs, Verdicts& verdicts, Effort effort) {
  const StraightTheory model;
  verdicts.section("wheel biases of 120 robots by the estimator of the ARGoS paper: straight.txtpb");
  const std::vector<Recorded> swarms =
      runs.sweep(runs.source("experiments/straight.txtpb"),
                 {"--robots", "120", "--duration", "62", "--seeds", seeds(effort.quick ? 2 : 20)});
  stats::Moments all, deviation, mean;
  for (const Recorded& run : swarms) {
    stats::Moments biases;
    for (std::size_t i = 0; i < run.robots(); ++i) {
      const WheelBias bias = estimate_bias(run.track(i, kFirstState), model, 10, 6);
      biases.add(bias.left_mm_s);
      biases.add(bias.right_mm_s);
      all.add(bias.left_mm_s);
      all.add(bias.right_mm_s);
    }
    mean.add(biases.mean());
    deviation.add(biases.standard_deviation());
  }
  // Standard errors of 240 Gaussian draws with the spread that was asked for.
  const double draws = 240, mean_error = model.bias_sd_mm_s / std::sqrt(draws),
               deviation_error = model.bias_sd_mm_s / std::sqrt(2 * (draws - 1));
  const auto count = static_cast<double>(swarms.size());
  verdicts.near_in_errors("mean of b, 120 robots", "mm/s",
                          {mean.mean() /* of seeds */, mean_error / std::sqrt(count)}, {model.bias_mean_mm_s}, 3);
  verdicts.near_in_errors("sd of b, 120 robots", "mm/s", {deviation.mean(), deviation_error / std::sqrt(count)},
                          {model.bias_sd_mm_s}, 3);
}

void validate_straight(Runs& runs, Verdicts& verdicts, Effort effort) {
  const StraightTheory model;
  verdicts.section("mean square displacement of 600 robots driving straight on: straight.txtpb");
  const std::vector<Recorded> swarms = runs.sweep(runs.source("experiments/straight.txtpb"),
                                                  {"--duration", "62", "--seeds", seeds(effort.quick ? 1 : 10)});
  const auto measured_at = [&](double time_s, double& exact_s) {
    stats::Moments robots;  // they are independent, whichever run they are of
    for (const Recorded& run : swarms) {
      const std::size_t at = run.state_at(run.time_s[kFirstState] + time_s);
      exact_s = run.time_s[at] - run.time_s[kFirstState];
      for (std::size_t i = 0; i < run.robots(); ++i) {
        const double dx = run.x_mm[at][i] - run.x_mm[kFirstState][i],
                     dy = run.y_mm[at][i] - run.y_mm[kFirstState][i];
        robots.add(dx * dx + dy * dy);
      }
    }
    return Figure{robots.mean(), robots.standard_error()};
  };
  for (const double time_s : {10.0, 20.0, 30.0, 40.0, 50.0, 60.0}) {
    double exact_s = 0;
    const Figure measured = measured_at(time_s, exact_s);
    verdicts.near_in_errors(fmt::format("closed form, {:.0f} s", time_s), "mm^2", measured,
                            {model.msd_mm2(exact_s)}, 3);
  }
  for (const ReferencePoint& point : kStraightNoise) {
    double exact_s = 0;
    const Figure measured = measured_at(point.time_s, exact_s);
    // ARGoS' robots start late; the closed form scales our figure to the same time.
    const double scale = model.msd_mm2(point.time_s - kStraightLag_s) / model.msd_mm2(exact_s);
    verdicts.near_in_errors(fmt::format("ARGoS (1000 robots), {:.0f} s", point.time_s), "mm^2",
                            {measured.value * scale, measured.error * scale}, {point.value, point.error}, 3);
  }
  if (!effort.plots.empty()) {
    Plot plot;
    plot.title = "600 robots drive straight on";
    plot.subtitle = "wheel biases bend their paths; bars: standard error of the mean";
    plot.x_name = "time";
    plot.x_unit = "s";
    plot.y_name = "mean square displacement";
    plot.y_unit = "mm\u00b2";
    plot.series.resize(3);
    plot.series[0].name = "closed form";
    plot.series[0].points = false;
    plot.series[1].name = "simulated";
    plot.series[2].name = "ARGoS";
    plot.series[1].line = plot.series[2].line = false;
    const auto put = [&plot](std::size_t series, double time_s, Figure figure) {
      plot.series[series].x.push_back(time_s);
      plot.series[series].y.push_back(figure.value);
      plot.series[series].error.push_back(figure.error);
    };
    for (double time_s = 0; time_s <= 60; ++time_s) put(0, time_s, {model.msd_mm2(time_s)});
    for (double time_s = 5; time_s <= 60; time_s += 5) {
      double exact_s = 0;
      const Figure measured = measured_at(time_s, exact_s);
      put(1, exact_s, measured);
    }
    for (const ReferencePoint& point : kStraightNoise) put(2, point.time_s, {point.value, point.error});
    write_plot(plot, effort.plots / "validation-straight.svg");
  }
  const std::vector<Recorded> clean =
      runs.sweep(runs.source("experiments/straight.txtpb"),
                 {"--duration", "62", "--robots", "4", "--set", "motion.noise=false"});
  const Recorded& run = clean[0];
  const std::size_t end = run.time_s.size() - 1;
  verdicts.near_in_parts("noise free: speed", "mm/s",
                         {std::sqrt(run.msd_mm2(kFirstState, end)) / (run.time_s[end] - run.time_s[kFirstState])},
                         {10}, 1e-9, 0);
}

}  // namespace kilotwin::validation
