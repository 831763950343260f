/// Posterior predictive check of a written model: the simulator repeats the measured runs, and summary statistics
/// of simulated and measured tracks are compared.
#pragma once

#include <nlohmann/json.hpp>

#include "clients/identify/fit/fitter.hpp"
#include "idl/model.pb.h"

namespace kilotwin::identify {

/// A model as fitted and as written.
struct WrittenModel {
  const MotionModel& fitted;
  const proto::Model& written;
};

/// Compares the tracks of `set` that count (`which`) with simulations of both models.
/// Estimates initial headings first. Returns
///   simulated      {engine, seeds, robots, runs, unit, statistics [{name, unit, distance, by_chance_95, p, agrees,
///                  base_distance, base_p}], agrees, in_words}; `agrees` is null with too few robots
///   distributions, msd, speed_over_time   plot data (identify.hpp)
/// Empty if the runs are too long to simulate or yield no statistic.
[[nodiscard]] nlohmann::json simulation_check(const WrittenModel& base, const WrittenModel& full, PreparedSet set,
                                              Tracks which, std::uint32_t threads);

}  // namespace kilotwin::identify
