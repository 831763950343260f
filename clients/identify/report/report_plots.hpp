/// The report's plots, each from one entry of the JSON of idl/identification.proto. An entry that is absent or
/// empty gives no plot.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>

#include "clients/report/gnuplot.hpp"

namespace kilotwin::identify {

using PlotNumber = std::optional<std::size_t>;

/// Error over the horizon: before, after, noise floor.
PlotNumber plot_horizon(Gnuplot&, const nlohmann::json& horizon);
/// One residual over one covariate: before and after.
PlotNumber plot_covariate(Gnuplot&, const nlohmann::json& plot);
/// Two residual components along x and y as arrows over the arena; `when`: "before" or "after".
PlotNumber plot_arrows(Gnuplot&, const nlohmann::json& map_x, const nlohmann::json& map_y, const char* when);
/// One residual over the arena in colours, with the same scale before and after. Default title: `when`.
PlotNumber plot_map(Gnuplot&, const nlohmann::json& map, const char* when, const std::string& title = "");
/// One distribution, simulated and measured.
PlotNumber plot_distribution(Gnuplot&, const nlohmann::json& distribution);
/// Mean speed over the run, simulated and measured.
PlotNumber plot_speed_over_time(Gnuplot&, const nlohmann::json& speeds);
/// A fitted effect over its covariate.
PlotNumber plot_effect(Gnuplot&, const nlohmann::json& curve);
PlotNumber plot_effect_map(Gnuplot&, const nlohmann::json& map);
PlotNumber plot_msd(Gnuplot&, const nlohmann::json& msd);
/// The error after each accepted effect.
PlotNumber plot_steps(Gnuplot&, const nlohmann::json& steps, double floor_mm);
/// The error of each robot before and after.
PlotNumber plot_robots(Gnuplot&, const nlohmann::json& robots);

/// Values over two covariates (at, and_at, covariates, units, value [and_at][at], unit) in colours. Cells are equally
/// wide, whatever their bins.
PlotNumber plot_table(Gnuplot&, const nlohmann::json& table, const std::string& title);

/// Readable name of a covariate, target or unit.
[[nodiscard]] std::string words_of(const std::string& name);

}  // namespace kilotwin::identify
