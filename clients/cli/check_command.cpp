// `kilotwin check`: makes all checks that are possible before a run.
#include <CLI/CLI.hpp>
#include <memory>

#include "clients/cli/commands.hpp"
#include "clients/cli/prepare.hpp"

namespace kilotwin::cli {
namespace {

int check(const RunArguments& arguments) {
  static_cast<void>(resolve(load_with_overrides(arguments), arguments, Notes::kSilent));
  return kDone;
}

}  // namespace

Command add_check(CLI::App& program) {
  const auto arguments = std::make_shared<RunArguments>();
  CLI::App& app = *program.add_subcommand(
      "check", "check an experiment and compile its programs; print nothing when all is right");
  add_experiment_options(app, *arguments);
  app.add_option("--set", arguments->set, "sets a field of the experiment")
      ->allow_extra_args(false)
      ->type_name("FIELD=VALUE");
  return {&app, [arguments] { return check(*arguments); }};
}

}  // namespace kilotwin::cli
