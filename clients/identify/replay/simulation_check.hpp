/// A second look at a written model, by nothing that fitted it: the simulator plays the measured runs again, and what its robots
/// look like is compared with what the measured ones look like.
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

/// Tracks of `set`, of those held out with `held_out_only`, beside tracks of the written models. Headings at starts are found
/// first. Gives
///   simulated      {engine, seeds, robots, runs, unit, statistics [{name, unit, distance, by_chance_95, p, agrees, base_distance,
///                  base_p}], agrees, in_words}; `agrees` is null where too few robots were seen to tell
///   distributions, msd, speed_over_time   for plots (identify.hpp)
/// Empty where the runs are too long to be played, or show nothing.
[[nodiscard]] nlohmann::json simulated_check(const WrittenModel& base, const WrittenModel& full, PreparedSet& set,
                                             bool held_out_only, std::uint32_t threads);

}  // namespace kilotwin::identify
