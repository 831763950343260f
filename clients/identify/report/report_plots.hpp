/// The report's plots, each from one message of idl/identification.proto. A message that is absent or empty gives no plot.
#pragma once

#include <optional>
#include <string>

#include "clients/report/gnuplot.hpp"
#include "idl/identification.pb.h"

namespace kilotwin::identify {

using PlotNumber = std::optional<std::size_t>;
enum class When { kBefore, kAfter };

/// Error over the horizon: before, after, noise floor.
PlotNumber plot_horizon(Gnuplot&, const identification::Horizon&);
/// One residual over one covariate: before and after.
PlotNumber plot_covariate(Gnuplot&, const identification::CovariatePlot&);
/// Two residual components along x and y as arrows over the arena.
PlotNumber plot_arrows(Gnuplot&, const identification::ResidualMap& x, const identification::ResidualMap& y, When);
/// One residual over the arena in colours, with the same scale before and after.
PlotNumber plot_map(Gnuplot&, const identification::ResidualMap&, When);
/// One distribution, simulated and measured.
PlotNumber plot_distribution(Gnuplot&, const identification::Distribution&);
/// Mean speed over the run, simulated and measured.
PlotNumber plot_speed_over_time(Gnuplot&, const identification::SpeedOverTime&);
/// A fitted effect over its covariate, with its 95 % band if known.
PlotNumber plot_effect(Gnuplot&, const identification::EffectCurve&);
/// A fitted effect over the arena. Crosses mark where its 95 % band holds zero.
PlotNumber plot_effect_map(Gnuplot&, const identification::EffectMap&);
PlotNumber plot_msd(Gnuplot&, const identification::Msd&);
/// The error after each accepted effect.
PlotNumber plot_steps(Gnuplot&, const google::protobuf::RepeatedPtrField<identification::Step>&, double floor_mm);
/// The error of each robot before and after.
PlotNumber plot_robots(Gnuplot&, const google::protobuf::RepeatedPtrField<identification::Robot>&);

enum class Component { kFirst, kSecond };
/// A component of the mean error over the bins of one covariate, or of two in colours. Cells are equally wide, whatever their
/// bins.
PlotNumber plot_pattern(Gnuplot&, const identification::Pattern&, Component);

/// Readable name of a covariate, target or unit.
[[nodiscard]] std::string words_of(const std::string& name);

}  // namespace kilotwin::identify
