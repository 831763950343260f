/// The likelihood of the cells in which one robot was heard, and predictions of where it goes: a particle filter over pose,
/// program and whatever the model's effects remember. Other robots are not there for it. It reads the effects from the model's
/// records, so that any of them counts.
#pragma once

#include <cstdint>
#include <vector>

#include "clients/identify/kilogrid/floor_model.hpp"

namespace kilotwin::kilogrid {

struct CellPrediction {
  double time_s;
  double x_mm, y_mm;  ///< expected cell, predicted
  double measured_x_mm, measured_y_mm;
};

struct CellFilterResult {
  double log_likelihood = 0;  ///< of the cells, given that there were reports
  std::size_t reports = 0;
  std::vector<CellPrediction> predictions;
};

/// Predicts `horizon_s` ahead for times 10, 15, 20... s, from reports up to then; where the robot was heard within a second.
[[nodiscard]] CellFilterResult filter_cells(const FloorTrack&, const Floor&, const FloorSettings&, double horizon_s,
                                            std::size_t particles, std::uint64_t seed);

/// The root mean square distance of a cell from the robot that it hears, mm: no prediction of cells can be better.
[[nodiscard]] double cell_noise_mm(const Floor&, const FloorRadio&);

}  // namespace kilotwin::kilogrid
