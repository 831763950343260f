/// The predictor that knows the truth: the scene with all of its effects, each robot's bias, the noise. What it cannot know
/// is where a robot really is, and the noise to come.
#pragma once

#include "tests/identify/truth/scene.hpp"

namespace kilotwin::truth {

struct Prediction {
  int run, robot;
  double time_s;
  Vec predicted;  // of the tracked point
  Vec truth;      // what the tracker would have seen without noise
};

/// Predictions horizon_s ahead for 10, 15, 20... s of each robot, from what was measured until horizon_s before. A robot that
/// was never seen by then has no row. Positions are averages over `samples` runs of all robots together, drawn from what
/// is known at the start of the prediction: an error of 1/(2 samples) in their RMSE.
std::vector<Prediction> predict(const Scene& scene, const std::vector<Individual>& individuals, const Run& run,
                                double horizon_s, int samples, std::uint64_t seed);

double rmse_mm(const std::vector<Prediction>& predictions);

}  // namespace kilotwin::truth
