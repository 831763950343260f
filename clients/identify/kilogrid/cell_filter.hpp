/// Particle filter over the cell reports of one robot: likelihood of the reports and position predictions. A
/// particle holds pose, program state and effect state. Other robots are not simulated. Effects come from the
/// model file's records, so any effect is supported.
#pragma once

#include <cstdint>
#include <vector>

#include "clients/identify/kilogrid/floor_model.hpp"

namespace kilotwin::kilogrid {

struct CellPrediction {
  double time_s;
  double x_mm, y_mm;  ///< expected cell centre, predicted
  double measured_x_mm, measured_y_mm;
};

struct CellFilterResult {
  double log_likelihood = 0;  ///< of the cells, given the report times
  std::size_t reports = 0;
  std::vector<CellPrediction> predictions;
};

/// Predicts `horizon_s` ahead for the times 10, 15, 20... s, from the reports up to one horizon before. Only times
/// within one second of a report.
[[nodiscard]] CellFilterResult filter_cells(const FloorTrack&, const Floor&, const FloorSettings&, double horizon_s,
                                            std::size_t particles, std::uint64_t seed);

/// Root mean square distance between a robot and the centre of the cell that reports it, mm: a lower bound for
/// cell predictions.
[[nodiscard]] double cell_noise_mm(const Floor&, const FloorRadio&);

}  // namespace kilotwin::kilogrid
