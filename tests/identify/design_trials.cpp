// How much recording time a planned recording saves: pairs of models, planted truths, plans beside random commands.
// Usage: design_trials [--recordings N] [--robots N] [--seconds S]
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "tests/identify/design_scenes.hpp"

namespace {

using kilotwin::identify::design_scenes::Decision;

/// Recording time and decisions of several recordings.
struct Tally {
  double seconds = 0;
  int right = 0, open = 0, wrong = 0;
  void add(const Decision& decision) {
    seconds += decision.after_s;
    ++(!decision.made ? open : decision.right ? right : wrong);
  }
  [[nodiscard]] double per_right_s() const { return seconds / right; }
};

Tally sum_of(const std::vector<Tally>& all, std::size_t without = std::size_t(-1)) {
  Tally sum;
  for (std::size_t n = 0; n < all.size(); ++n) {
    if (n == without) continue;
    sum.seconds += all[n].seconds;
    sum.right += all[n].right;
    sum.open += all[n].open;
    sum.wrong += all[n].wrong;
  }
  return sum;
}

double saved(const Tally& random, const Tally& plan) { return 1 - plan.per_right_s() / random.per_right_s(); }

/// Of saved(), by the jackknife over recordings.
double standard_error(const std::vector<Tally>& by_random, const std::vector<Tally>& by_plan) {
  const auto count = static_cast<double>(by_random.size());
  double sum = 0, squares = 0;
  for (std::size_t n = 0; n < by_random.size(); ++n) {
    const double one = saved(sum_of(by_random, n), sum_of(by_plan, n));
    sum += one;
    squares += one * one;
  }
  return std::sqrt(std::max(0.0, squares - sum * sum / count) * (count - 1) / count);
}

}  // namespace

int main(int argc, char** argv) {
  using namespace kilotwin::identify;
  std::uint32_t recordings = 10, robots = 4, threads = 2;
  double seconds = 240;
  CLI::App app("Recording time that a plan saves over random commands");
  app.add_option("--recordings", recordings, "of each pair, truth and kind of commands")->capture_default_str();
  app.add_option("--robots", robots)->capture_default_str();
  app.add_option("--seconds", seconds, "longest recording")->capture_default_str();
  app.add_option("--threads", threads)->capture_default_str();
  CLI11_PARSE(app, argc, argv);

  fmt::print(
      "| pair | expected, random, s | expected, plan, s | right, undecided, wrong: random | the same: plan | "
      "robot-minutes per right decision: random | the same: plan | saved |\n");
  fmt::print("|---|---|---|---|---|---|---|---|\n");
  for (const design_scenes::Pair& pair : design_scenes::pairs()) {
    design_scenes::Scene scene = design_scenes::scene_of(pair, robots, seconds);
    scene.options.threads = threads;
    const Design design = design_recording(scene.question, scene.conditions, scene.options);
    std::vector<Tally> by_random(recordings), by_plan(recordings);
    for (std::uint32_t n = 0; n < recordings; ++n) {
      // Numbers beyond those of the plans that the search saw.
      const RecordingPlan random = random_plan(scene.options, 100 + n);
      for (const std::size_t truth : {std::size_t{0}, std::size_t{1}}) {
        by_random[n].add(decide(scene, random, truth, 1000 + n));
        by_plan[n].add(decide(scene, design.plan, truth, 1000 + n));
      }
    }
    const Tally random = sum_of(by_random), plan = sum_of(by_plan);
    const double minutes = static_cast<double>(robots) / 60;
    fmt::print("| {} | {:.3g} | {:.3g} | {}, {}, {} | {}, {}, {} | {:.2f} | {:.2f} | {:.0f} +- {:.0f} % |\n",
               pair.name, design.random_s, design.planned_s, random.right, random.open, random.wrong, plan.right,
               plan.open, plan.wrong, random.per_right_s() * minutes, plan.per_right_s() * minutes,
               100 * saved(random, plan), 100 * standard_error(by_random, by_plan));
    std::fflush(stdout);
  }
}
