/// The report's plots, each from a part of the document (identify.hpp tells its keys). A part that is missing, empty or
/// not of that form gives no plot.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>

#include "clients/identify/report/gnuplot.hpp"

namespace kilotwin::identify {

using PlotNumber = std::optional<std::size_t>;

/// Error over how far ahead: before, after, floor.
PlotNumber plot_horizon(Gnuplot&, const nlohmann::json& horizon);
/// One residual over one covariate: before, after, and the effect as it was added.
PlotNumber plot_covariate(Gnuplot&, const nlohmann::json& plot);
/// Two residuals of the same kind, along x and y, as arrows over the arena; `when`: "before" or "after".
PlotNumber plot_arrows(Gnuplot&, const nlohmann::json& map_x, const nlohmann::json& map_y, const char* when);
/// One residual over the arena in colours; both times in the same ones. Without a title: when.
PlotNumber plot_map(Gnuplot&, const nlohmann::json& map, const char* when, const std::string& title = "");
/// One distribution, simulated over measured.
PlotNumber plot_distribution(Gnuplot&, const nlohmann::json& distribution);
/// Mean speed over the run, simulated over measured.
PlotNumber plot_speed_over_time(Gnuplot&, const nlohmann::json& speeds);
/// An effect as it is in the model, over its covariate.
PlotNumber plot_effect(Gnuplot&, const nlohmann::json& curve);
PlotNumber plot_effect_map(Gnuplot&, const nlohmann::json& map);
PlotNumber plot_msd(Gnuplot&, const nlohmann::json& msd);
/// The error as effects were added, one after the other.
PlotNumber plot_steps(Gnuplot&, const nlohmann::json& steps, double floor_mm);
/// Each robot's error before and after.
PlotNumber plot_robots(Gnuplot&, const nlohmann::json& robots);

/// A covariate, target or unit as a person reads it.
[[nodiscard]] std::string words_of(const std::string& name);

}  // namespace kilotwin::identify
