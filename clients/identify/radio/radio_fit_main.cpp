// The study of radio counts as a program of its own, with other amounts of work: for bench/radio.
#include <CLI/CLI.hpp>
#include <filesystem>

#include "clients/identify/radio/radio_study.hpp"
#include "core/base/error.hpp"
#include "core/base/say.hpp"

int main(int argc, char** argv) {
  using namespace kilotwin;
  CLI::App app{"Fits the radio model to measured grids of robots (comm_tau*_run*.dat)"};
  radio_fit::RadioData data;
  radio_fit::RadioWork work{40, 200};
  std::filesystem::path out;
  app.add_option("--train", data.train, "directory of training runs")->required();
  app.add_option("--test", data.test, "directory of test runs; none: every other run of --train");
  app.add_option("--out", out, "directory for model.txtpb, result.json, effects.md and figures")->required();
  app.add_flag("--swap", data.swap, "exchange training and held-out half");
  app.add_option("--runs", work.runs, "simulated runs per effect and set")->check(CLI::Range(4, 10000));
  app.add_option("--swarms", work.swarms, "random swarms of the fitted population")->check(CLI::Range(1, 10000));
  app.add_flag("--placements", work.placements,
               "also compare with swarms of the population's placement and of drawn placements: placements.md");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  try {
    const identify::Options options;
    (void)identify::identified_by(*radio_fit::radio_study(data, work, out, options), options);
  } catch (const UserError& error) {
    say(error.what());
    return 2;
  } catch (const std::exception& error) {
    say(error.what());
    return 1;
  }
  return 0;
}
