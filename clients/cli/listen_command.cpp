// `kilotwin listen`: what a real robot hears and prints becomes what real robots say to simulated ones.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <filesystem>
#include <memory>
#include <thread>

#include "clients/cli/commands.hpp"
#include "clients/cli/door_options.hpp"
#include "clients/doors/listener/line_source.hpp"
#include "clients/doors/listener/listener.hpp"
#include "core/base/say.hpp"
#include "core/os/interrupt.hpp"

namespace kilotwin::cli {
namespace {

/// Speed of kilolib's debug port.
constexpr int kKilolibBaud = 38400;
/// How often an interrupt is looked for, and how long the run may take to get the last messages, s.
constexpr double kLook_s = 0.1, kLast_s = 2;

struct ListenArguments : DoorArguments {
  std::filesystem::path line;
  int baud = kKilolibBaud;
  bool once = false;
};

int listen(const ListenArguments& arguments) {
  catch_interrupts();
  const LoadedExperiment loaded = load_experiment(arguments.experiment);
  const doors::Door door = doors::open_door(loaded, proto::Door::kListener, arguments.door);
  doors::LineSource source(arguments.line, arguments.baud);
  doors::Listener listener(door);
  const dds::Participant participant(arguments.run);
  doors::HeardWriter writer(participant, door.settings.name());
  say(fmt::format("kilotwin: listens to {} as \"{}\" for the run on domain {}", one_line(arguments.line.string()),
                  one_line(door.settings.name(), 64), arguments.run.domain));
  while (interrupted() == 0 && arguments.once && writer.readers() == 0)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  while (interrupted() == 0 && !(arguments.once && source.at_end())) {
    for (const std::string& line : source.read(kLook_s)) {
      if (const auto message = listener.heard(line)) writer.write(*message);
    }
  }
  static_cast<void>(writer.flush(kLast_s));
  say("kilotwin: heard " + listener.in_words());
  return kDone;
}

}  // namespace

Command add_listen(CLI::App& program) {
  const auto arguments = std::make_shared<ListenArguments>();
  CLI::App& app =
      *program.add_subcommand("listen", "messages of real robots, from the serial line of one that hears them");
  add_door_options(app, *arguments, "listener");
  app.add_option("LINE", arguments->line, "serial port, pseudo-terminal, or a file that grows")
      ->required()
      ->type_name("");
  app.add_option("--baud", arguments->baud, "speed of a serial port")->capture_default_str()->type_name("BAUD");
  app.add_flag("--once", arguments->once, "wait for a run, and end with the file");
  app.footer("Example: kilotwin listen lab.txtpb /dev/ttyUSB1 --domain 7");
  return {&app, [arguments] { return listen(*arguments); }};
}

}  // namespace kilotwin::cli
