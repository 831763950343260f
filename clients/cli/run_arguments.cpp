#include "clients/cli/run_arguments.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <limits>
#include <string>
#include <system_error>

namespace kilotwin::cli {
namespace {

/// Checks a seed: decimal, leading zeros allowed. Refuses a number beyond 64 bits, because truncation would make another seed of it.
std::string decimal_seed(std::string& text) {
  std::uint64_t seed = 0;
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, seed);
  if (error != std::errc() || end != last) {
    return fmt::format("\"{}\" is no seed; give a whole number, 0..{}", text,
                       std::numeric_limits<std::uint64_t>::max());
  }
  text = std::to_string(seed);
  return {};
}

}  // namespace

void add_experiment_options(CLI::App& app, RunArguments& arguments) {
  app.add_option("EXPERIMENT", arguments.experiment, "experiment file (*.txtpb)")->required()->type_name("");
  app.add_option("--duration", arguments.duration_s, "simulated time, s")->type_name("SECONDS");
  app.add_option("--robots", arguments.robots, "replaces the first robot group's count")->type_name("N");
  app.add_option("--behaviour", arguments.behaviour,
                 "replaces the first robot group's program (.c, .so, .elf or .hex)")
      ->type_name("FILE");
  app.add_option("--define", arguments.define, "a macro for the programs that are compiled")
      ->allow_extra_args(false)
      ->type_name("NAME=VALUE");
  app.add_option(
         "--kilolib", arguments.kilolib,
         "the library that the programs are written for, kilobot or kilogrid (default: what their sources and "
         "headers show)")
      ->type_name("NAME");
  app.add_option("--model", arguments.model, "model file (*.txtpb) in place of the experiment's model")
      ->type_name("FILE");
}

void add_strict_option(CLI::App& app, RunArguments& arguments) {
  app.add_flag(
      "--strict", arguments.strict,
      "a run in which a robot's program fails counts as failed: it is listed, not in the means, and the status "
      "is 1");
}

void add_change_options(CLI::App& app, RunArguments& arguments) {
  app.add_option("--seed", arguments.seed, "seed of all random numbers")
      ->transform(CLI::Validator(decimal_seed, ""))
      ->type_name("N");
  app.add_option("--set", arguments.set,
                 "sets a field of the experiment, for example robots[0].layout.grid.pitch_mm=33")
      ->allow_extra_args(false)
      ->type_name("FIELD=VALUE");
}

}  // namespace kilotwin::cli
