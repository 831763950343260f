/// SweepDesigns: which point of a sweep survives what is uncertain about the robots. A sweep over several models has designs, the points
/// without their model. Each design runs with all models and seeds, so designs are compared run by run.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "clients/cli/sweep_points.hpp"
#include "core/stats/moments.hpp"

namespace kilotwin::cli {

/// The field of a point that is its model file; run_words() makes --model of it. An experiment has no such field.
inline constexpr const char* kModelField = "model";
/// Whether a point's setting is that of the model.
[[nodiscard]] bool is_model(const std::string& set);
/// Each point with each model, the models running fastest.
[[nodiscard]] std::vector<SweepPoint> with_models(const std::vector<SweepPoint>& points,
                                                  const std::vector<std::filesystem::path>& models);

struct Design {
  SweepPoint fields;           ///< without the model
  stats::Moments over_models;  ///< of the means over seeds
  double worst = 0;            ///< of these means
  std::string worst_model;     ///< where that is
  stats::Moments to_best;      ///< per model: mean over common seeds of the value less that of the design of rank 1
  std::size_t rank = 0;        ///< by `worst`, from 1; 0: it has no value with some model
};

class SweepDesigns {
 public:
  /// `largest`: whether a larger value is better.
  SweepDesigns(const std::vector<SweepPoint>& points, bool largest);

  /// Adds the value of a run. Values that are not finite are left out.
  void add(std::size_t point, std::uint64_t seed, double value);
  /// By rank; those without a rank last.
  [[nodiscard]] std::vector<Design> ranked() const;

 private:
  using BySeed = std::map<std::uint64_t, double>;
  struct OfDesign {
    SweepPoint fields;
    std::map<std::string, BySeed> by_model;
  };
  [[nodiscard]] Design design_of(const OfDesign& values) const;

  const bool largest_;
  std::vector<std::pair<std::size_t, std::string>> place_;  ///< per point: its design and its model
  std::vector<OfDesign> designs_;
};

/// The designs as CSV and as rows of a table for people. `observable`: the name of the column.
[[nodiscard]] std::string designs_csv(const std::vector<Design>& designs, const std::string& observable);
[[nodiscard]] std::vector<std::vector<std::string>> design_rows(const std::vector<Design>& designs,
                                                                const std::string& observable);

}  // namespace kilotwin::cli
