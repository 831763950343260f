// `kilotwin control`: steers a run from a shell or a script.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "clients/cli/commands.hpp"
#include "clients/cli/control_requests.hpp"
#include "core/base/error.hpp"
#include "core/base/pose.hpp"
#include "core/base/say.hpp"
#include "core/dds/dds.hpp"
#include "core/os/interrupt.hpp"

namespace kilotwin::cli {
namespace {

struct ControlArguments {
  std::string command;
  std::uint32_t steps = 0, domain = 0;
  std::optional<std::uint32_t> robot, movable;
  std::vector<double> at_mm;
  double heading_deg = 0;
  bool json = false;
  double patience_s = 10;
};

using Status = RunControl::Status;

std::string in_words(const Status& status) {
  std::string text =
      fmt::format("{} is {} at tick {} of {}, {:.3f} s simulated, {:.1f} s of wall time\n", one_line(status.name),
                  name_of(status.phase), status.tick, status.last_tick, status.simulated_s, status.wall_s);
  text += fmt::format("robots    {}{}\nmessages  {} sent, {} received\n", status.robots,
                      status.robots_failed == 0 ? "" : fmt::format(", {} failed", status.robots_failed),
                      status.sent, status.received);
  if (status.note[0] != '\0') text += fmt::format("note      {}\n", one_line(status.note));
  return text;
}

void require_steps(const ControlArguments& arguments) {
  if (arguments.command == "step" && arguments.steps == 0)
    throw UserError("control: step needs a number of ticks; for example: kilotwin control step 10");
  if (arguments.command != "step" && arguments.steps != 0)
    throw UserError(fmt::format("control: {} takes no number; only step does", arguments.command));
}

void require_place(const ControlArguments& arguments) {
  const bool places = arguments.command == "place";
  const bool whom = arguments.robot || arguments.movable;
  if (places && (!whom || arguments.at_mm.empty()))
    throw UserError(
        "control: place needs a robot or a movable body, and a place; for example: "
        "kilotwin control place --robot 3 --at 100 -50 --heading 90");
  if (!places && (whom || !arguments.at_mm.empty()))
    throw UserError(fmt::format("control: {} takes no place; only place does", arguments.command));
}

ControlRequest request_of(const ControlArguments& arguments) {
  ControlRequest request{
      arguments.command, arguments.steps, {}, std::chrono::duration<double>(arguments.patience_s)};
  if (arguments.command == "place")
    request.place = Relocation{arguments.movable.has_value(),
                               arguments.movable ? *arguments.movable : *arguments.robot,
                               {arguments.at_mm[0], arguments.at_mm[1], arguments.heading_deg * kPi / 180}};
  return request;
}

int work(const ControlArguments& arguments) {
  require_steps(arguments);
  require_place(arguments);
  catch_interrupts();
  if (arguments.command == "requests") {
    serve_requests(arguments.domain, std::chrono::duration<double>(arguments.patience_s));
    return kDone;
  }
  RunControl control(arguments.domain);
  const Status status = carry_out(control, request_of(arguments));
  fmt::print("{}",
             arguments.json
                 ? in_json(status).dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n"
                 : in_words(status));
  return status.phase == kilotwin_open_BROKEN ? kFailed : kDone;
}

}  // namespace

Command add_control(CLI::App& program) {
  const auto arguments = std::make_shared<ControlArguments>();
  CLI::App& app = *program.add_subcommand(
      "control", "pause, step, continue, save or stop a run; move a robot; say how it goes");
  app.add_option(
         "COMMAND", arguments->command,
         "pause, continue, step, stop, checkpoint, place or status; or requests, which come on standard input")
      ->required()
      ->check(CLI::IsMember({"pause", "continue", "step", "stop", "checkpoint", "place", "status", "requests"})
                  .description(""))
      ->type_name("");
  app.add_option("STEPS", arguments->steps, "with step: the ticks after which the run pauses again")->type_name("");
  const auto robot = app.add_option("--robot", arguments->robot, "with place: the robot")->type_name("N");
  app.add_option("--movable", arguments->movable, "with place: the movable body, by its number from 0")
      ->excludes(robot)
      ->type_name("N");
  app.add_option("--at", arguments->at_mm,
                 "with place: where its centre comes to stand, mm from the arena's centre")
      ->expected(2)
      ->type_name("X Y");
  app.add_option("--heading", arguments->heading_deg, "with place: degrees anticlockwise from the x axis")
      ->check(CLI::Range(-360.0, 360.0).description(""))
      ->capture_default_str()
      ->type_name("DEG");
  app.add_option("--domain", arguments->domain,
                 "DDS domain of the run, which `kilotwin run` prints; local runs (--mode local) have none")
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
