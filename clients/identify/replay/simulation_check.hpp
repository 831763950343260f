/// Posterior predictive check of a written model: the simulator repeats the measured runs, and summary statistics
/// of simulated and measured tracks are compared.
#pragma once

#include "clients/identify/fit/fitter.hpp"
#include "idl/identification.pb.h"
#include "idl/model.pb.h"

namespace kilotwin::identify {

/// A model as fitted and as written.
struct WrittenModel {
  const MotionModel& fitted;
  const proto::Model& written;
};

/// Compares the tracks of `set` that count (`which`) with simulations of both models.
/// Estimates initial headings first. Fills result.simulated and the plots distributions, msd and speed_over_time. Fills
/// nothing if the runs are too long to simulate or yield no statistic.
void add_simulation_check(const WrittenModel& base, const WrittenModel& full, PreparedSet set, Tracks which,
                          std::uint32_t threads, identification::Identification&);

}  // namespace kilotwin::identify
