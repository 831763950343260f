#include <fmt/format.h>

#include "clients/report/plot.hpp"
#include "tests/validation/reference.hpp"
#include "tests/validation/validations.hpp"

namespace kilotwin::validation {
namespace {

/// Largest relative deviation from ARGoS.
constexpr double kAgreement = 0.1;

Figure msd_at(const std::vector<Recorded>& swarms, double time_s) {
  std::vector<double> values;
  for (const Recorded& run : swarms) values.push_back(run.msd_mm2(0, run.state_at(time_s)));
  return mean_of(values);
}

PlotSeries curve(const std::string& name, const std::vector<Recorded>& swarms) {
  PlotSeries series;
  series.name = name;
  series.points = false;
  series.band = true;
  for (double time_s = 0; time_s <= 180; time_s += 2) {
    const Figure figure = msd_at(swarms, time_s);
    series.x.push_back(time_s);
    series.y.push_back(figure.value);
    series.error.push_back(figure.error);
  }
  return series;
}

template <std::size_t kPoints>
PlotSeries points(const std::string& name, const std::array<ReferencePoint, kPoints>& reference) {
  PlotSeries series;
  series.name = name;
  series.line = false;
  for (const ReferencePoint& point : reference) {
    series.x.push_back(point.time_s);
    series.y.push_back(point.value);
    series.error.push_back(point.error);
  }
  return series;
}

}  // namespace

void validate_diffusion(Runs& runs, Verdicts& verdicts, Effort effort) {
  const std::string experiment = runs.source("experiments/diffusion.txtpb"),
                    seeds = effort.quick ? "1..20" : "1..200";
  verdicts.section(fmt::format("mean square displacement of a crowd of 50, seeds {}: diffusion.txtpb", seeds));
  const std::vector<Recorded> crowd = runs.sweep(experiment, {"--seeds", seeds});
  const std::vector<Recorded> free =
      runs.sweep(experiment, {"--seeds", seeds, "--set", "physics.engine=KINEMATIC"});
  for (const ReferencePoint& point : kDiffusionRing) {
    // Few runs tell the late crowd alone, and their own spread is allowed for.
    if (effort.quick && point.time_s < 100) continue;
    verdicts.near_in_parts(fmt::format("ARGoS, {:.0f} s", point.time_s), "mm^2", msd_at(crowd, point.time_s),
                           {point.value, point.error}, kAgreement, effort.quick ? 3 : 0);
  }
  for (const ReferencePoint& point : kDiffusionFar) {
    verdicts.near_in_parts(fmt::format("without contact: ARGoS, robots far apart, {:.0f} s", point.time_s), "mm^2",
                           msd_at(free, point.time_s), {point.value, point.error}, kAgreement,
                           effort.quick ? 3 : 0);
  }
  for (const double time_s : {10.0, 60.0, 120.0, 180.0}) {
    // Contact lowers the displacement by more than 10 % would explain.
    const Figure with = msd_at(crowd, time_s), without = msd_at(free, time_s);
    verdicts.at_least(fmt::format("without contact over with contact, {:.0f} s", time_s), "",
                      {without.value / with.value}, 1 + kAgreement);
  }
  if (effort.plots.empty()) return;
  Plot plot;
  plot.title = "A crowd of 50 robots diffuses";
  plot.subtitle = fmt::format("seeds {}; shaded and bars: standard error of the mean", seeds);
  plot.x_name = "time";
  plot.x_unit = "s";
  plot.y_name = "mean square displacement";
  plot.y_unit = "mm\u00b2";
  plot.series = {curve("contact", crowd), points("ARGoS", kDiffusionRing), curve("no contact", free),
                 points("ARGoS, far apart", kDiffusionFar)};
  write_plot(plot, effort.plots / "validation-diffusion.svg");
}

}  // namespace kilotwin::validation
