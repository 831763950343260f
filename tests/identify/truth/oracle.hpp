/// The oracle: a predictor that knows the scene with all effects, the biases and the noise levels. It does not
/// know the true poses or the future noise.
#pragma once

#include "tests/identify/truth/scene.hpp"

namespace kilotwin::truth {

struct Prediction {
  int run, robot;
  double time_s;
  Vec predicted;  // of the tracked point
  Vec truth;      // noise-free measurement
};

/// Predictions horizon_s ahead for 10, 15, 20... s of each robot, from measurements until horizon_s before. Robots
/// without a measurement by then have no row. Positions are means over `samples` joint rollouts of all robots,
/// which adds a relative error of 1/(2 samples) to the RMSE.
std::vector<Prediction> predict(const Scene& scene, const std::vector<Individual>& individuals, const Run& run,
                                double horizon_s, int samples, std::uint64_t seed);

double rmse_mm(const std::vector<Prediction>& predictions);

}  // namespace kilotwin::truth
