// `kilotwin control`: steers a run from a shell or a script.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "clients/cli/commands.hpp"
#include "clients/cli/run_control.hpp"
#include "core/base/error.hpp"
#include "core/dds/dds.hpp"
#include "core/os/interrupt.hpp"

namespace kilotwin::cli {
namespace {

struct ControlArguments {
  std::string command;
  std::uint32_t steps = 0, domain = 0;
  bool json = false;
  double patience_s = 10;
};

using Status = RunControl::Status;

const char* name_of(kilotwin_open_RunPhase phase) {
  switch (phase) {
    case kilotwin_open_STARTING: return "starting";
    case kilotwin_open_RUNNING: return "running";
    case kilotwin_open_PAUSED: return "paused";
    case kilotwin_open_ENDED: return "ended";
    case kilotwin_open_BROKEN: return "broken";
  }
  return "unknown";
}

std::string in_json(const Status& status) {
  const nlohmann::ordered_json json{{"run", fmt::format("{:016x}", status.run)},
                                    {"name", status.name},
                                    {"phase", name_of(status.phase)},
                                    {"tick", status.tick},
                                    {"last_tick", status.last_tick},
                                    {"simulated_s", status.simulated_s},
                                    {"wall_s", status.wall_s},
                                    {"robots", status.robots},
                                    {"robots_failed", status.robots_failed},
                                    {"sent", status.sent},
                                    {"received", status.received},
                                    {"note", status.note}};
  return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

std::string in_words(const Status& status) {
  std::string text =
      fmt::format("{} is {} at tick {} of {}, {:.3f} s simulated, {:.1f} s of wall time\n", status.name,
                  name_of(status.phase), status.tick, status.last_tick, status.simulated_s, status.wall_s);
  text += fmt::format("robots    {}{}\nmessages  {} sent, {} received\n", status.robots,
                      status.robots_failed == 0 ? "" : fmt::format(", {} failed", status.robots_failed),
                      status.sent, status.received);
  if (status.note[0] != '\0') text += fmt::format("note      {}\n", status.note);
  return text;
}

void require_steps(const ControlArguments& arguments) {
  if (arguments.command == "step" && arguments.steps == 0)
    throw UserError("control: step needs a number of ticks; for example: kilotwin control step 10");
  if (arguments.command != "step" && arguments.steps != 0)
    throw UserError(fmt::format("control: {} takes no number; only step does", arguments.command));
}

/// Sends the command and waits for its effect.
Status carry_out(RunControl& control, const ControlArguments& arguments, const Status& before) {
  const std::chrono::duration<double> patience(arguments.patience_s);
  const auto ask = [&](kilotwin_open_RunCommand command) { control.send(command, arguments.steps, patience); };
  if (arguments.command == "pause") {
    ask(kilotwin_open_PAUSE_RUN);
    return control.await([](const Status& now) { return now.phase == kilotwin_open_PAUSED; }, "pause", patience);
  }
  if (arguments.command == "continue") {
    ask(kilotwin_open_CONTINUE_RUN);
    return control.await([](const Status& now) { return now.phase == kilotwin_open_RUNNING; }, "continue",
                         patience);
  }
  if (arguments.command == "step") {
    ask(kilotwin_open_STEP_RUN);
    return control.await(
        [&](const Status& now) {
          return now.phase == kilotwin_open_PAUSED && now.tick >= before.tick + arguments.steps;
        },
        "take these steps", patience);
  }
  if (arguments.command == "stop") {
    ask(kilotwin_open_STOP_RUN);
    return control.await([](const Status& now) { return is_over(now.phase); }, "end", patience);
  }
  ask(kilotwin_open_CHECKPOINT_RUN);
  return before;
}

int work(const ControlArguments& arguments) {
  require_steps(arguments);
  catch_interrupts();
  RunControl control(arguments.domain);
  const std::chrono::duration<double> patience(arguments.patience_s);
  Status status = control.find(patience);
  if (arguments.command != "status") {
    if (is_over(status.phase))
      throw RunError(fmt::format("the run {} is over; there is nothing to {}", status.name, arguments.command));
    status = carry_out(control, arguments, status);
    if (is_over(status.phase) && arguments.command != "stop")
      throw RunError(fmt::format("the run {} came to its end before it could {}", status.name, arguments.command));
  }
  fmt::print("{}", arguments.json ? in_json(status) : in_words(status));
  return status.phase == kilotwin_open_BROKEN ? kFailed : kDone;
}

}  // namespace

Command add_control(CLI::App& program) {
  const auto arguments = std::make_shared<ControlArguments>();
  CLI::App& app = *program.add_subcommand("control", "pause, step, continue, save or stop a run; say how it goes");
  app.add_option("COMMAND", arguments->command, "pause, continue, step, stop, checkpoint or status")
      ->required()
      ->check(CLI::IsMember({"pause", "continue", "step", "stop", "checkpoint", "status"}).description(""))
      ->type_name("");
  app.add_option("STEPS", arguments->steps, "with step: the ticks after which the run pauses again")->type_name("");
  app.add_option("--domain", arguments->domain, "DDS domain of the run, which `kilotwin run` prints")
      ->check(CLI::Range(0u, dds::kLastDomain).description(""))
      ->capture_default_str()
      ->type_name("N");
  app.add_flag("--json", arguments->json, "print the status as one line of JSON");
  app.add_option("--patience", arguments->patience_s, "end with status 1 where the run has not followed by then")
      ->check(CLI::Range(0.1, 1e6).description(""))
      ->capture_default_str()
      ->type_name("SECONDS");
  app.footer("Example: kilotwin control step 10 --domain 7");
  return {&app, [arguments] { return work(*arguments); }};
}

}  // namespace kilotwin::cli
