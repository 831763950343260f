// The radio fit as a program of its own.
#include <CLI/CLI.hpp>

#include "clients/identify/radio/radio_fit.hpp"
#include "core/base/error.hpp"
#include "core/base/say.hpp"

int main(int argc, char** argv) {
  using namespace kilotwin;
  CLI::App app{"Fits the radio model to measured grids of robots (comm_tau*_run*.dat)"};
  radio_fit::FitOptions options;
  app.add_option("--train", options.train, "directory of training runs")->required();
  app.add_option("--test", options.test, "directory of test runs; none: every other run of --train");
  app.add_option("--out", options.out, "directory for model.txtpb, result.json, effects.md and figures")
      ->required();
  app.add_flag("--swap", options.swap, "exchange training and held-out half");
  app.add_option("--runs", options.runs, "simulated runs per effect and set")->check(CLI::Range(4, 10000));
  app.add_option("--swarms", options.swarms, "random swarms of the fitted population")->check(CLI::Range(1, 10000));
  app.add_flag("--placements", options.placements,
               "also compare with swarms of the population's placement and of drawn placements: placements.md");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  try {
    radio_fit::fit_radio(options);
  } catch (const UserError& error) {
    say(error.what());
    return 2;
  } catch (const std::exception& error) {
    say(error.what());
    return 1;
  }
  return 0;
}
