// How much recording time a planned recording saves: pairs of models, planted truths, plans beside random commands.
// Usage: design_trials [--recordings N] [--robots N] [--seconds S]
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "tests/identify/design_scenes.hpp"

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
      "| pair | expected, random, s | expected, plan, s | random, robot-minutes | plan, robot-minutes | saved | "
      "undecided, wrong: random | undecided, wrong: plan |\n");
  fmt::print("|---|---|---|---|---|---|---|---|\n");
  for (const design_scenes::Pair& pair : design_scenes::pairs()) {
    design_scenes::Scene scene = design_scenes::scene_of(pair, robots, seconds);
    scene.options.threads = threads;
    const Design design = design_recording(scene.question, scene.conditions, scene.options);
    struct Sum {
      double seconds = 0;
      int open = 0, wrong = 0;
      void add(const design_scenes::Decision& decision) {
        seconds += decision.after_s;
        open += decision.made ? 0 : 1;
        wrong += decision.made && !decision.right ? 1 : 0;
      }
    } by_random, by_plan;
    for (std::uint32_t n = 0; n < recordings; ++n) {
      // Numbers beyond those of the plans that the search saw.
      const RecordingPlan random = random_plan(scene.options, 100 + n);
      for (const std::size_t truth : {std::size_t{0}, std::size_t{1}}) {
        by_random.add(decide(scene, random, truth, 1000 + n));
        by_plan.add(decide(scene, design.plan, truth, 1000 + n));
      }
    }
    const std::uint32_t count = 2 * recordings;
    const double minutes = static_cast<double>(robots) / 60 / count;
    fmt::print("| {} | {:.3g} | {:.3g} | {:.2f} | {:.2f} | {:.0f} % | {}, {} of {} | {}, {} of {} |\n", pair.name,
               design.random_s, design.planned_s, by_random.seconds * minutes, by_plan.seconds * minutes,
               100 * (1 - by_plan.seconds / by_random.seconds), by_random.open, by_random.wrong, count,
               by_plan.open, by_plan.wrong, count);
    std::fflush(stdout);
  }
}
