// `kilotwin play`: a log of a tracker takes the tracker's place.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <filesystem>
#include <memory>
#include <thread>

#include "clients/cli/commands.hpp"
#include "clients/cli/door_options.hpp"
#include "clients/doors/logs/log_player.hpp"
#include "core/base/say.hpp"
#include "core/os/interrupt.hpp"

namespace kilotwin::cli {
namespace {

using std::chrono::nanoseconds;
using std::chrono::steady_clock;

struct PlayArguments : DoorArguments {
  std::filesystem::path log;
  double speed = 1;
  bool loop = false;
};

/// How often an interrupt is looked for.
constexpr nanoseconds kNap{20'000'000};
/// How long the run may take to get the last frames, s.
constexpr double kLast_s = 2;

/// False where it was interrupted first.
bool wait_until(steady_clock::time_point due) {
  while (interrupted() == 0) {
    const auto left = due - steady_clock::now();
    if (left <= nanoseconds(0)) return true;
    std::this_thread::sleep_for(std::min<nanoseconds>(left, kNap));
  }
  return false;
}

bool wait_for_run(const doors::FrameWriter& writer, std::uint32_t domain) {
  bool said = false;
  while (interrupted() == 0) {
    if (writer.readers() > 0) return true;
    if (!std::exchange(said, true)) say(fmt::format("kilotwin: waits for a run on domain {}", domain));
    std::this_thread::sleep_for(kNap);
  }
  return false;
}

int play(const PlayArguments& arguments) {
  catch_interrupts();
  const LoadedExperiment loaded = load_experiment(arguments.experiment);
  const doors::Door door = doors::open_door(loaded, proto::Door::kLog, arguments.door);
  const doors::LogExtent extent = doors::check_log(arguments.log, door.settings.log());
  doors::LogPlayer player(door, arguments.log, extent, arguments.speed, arguments.loop);
  const dds::Participant participant(arguments.run);
  doors::FrameWriter writer(participant, door.settings.name(), topics::played_frames());
  if (!wait_for_run(writer, arguments.run.domain)) return kDone;
  say(fmt::format("kilotwin: plays {} rows, {:.1f} s, as \"{}\" on domain {}", extent.rows,
                  (extent.last_s - extent.first_s) / arguments.speed, one_line(door.settings.name(), 64),
                  arguments.run.domain));
  const auto began = steady_clock::now();
  while (auto due = player.next()) {
    if (!wait_until(began + nanoseconds(due->after_ns))) break;
    due->frame.sent_ns = (steady_clock::now() - began) / nanoseconds(1);
    writer.write(due->frame);
  }
  if (!writer.flush(kLast_s)) say("kilotwin: the run did not confirm the last frames");
  say("kilotwin: played " + player.tally().in_words());
  return kDone;
}

}  // namespace

Command add_play(CLI::App& program) {
  const auto arguments = std::make_shared<PlayArguments>();
  CLI::App& app =
      *program.add_subcommand("play", "play a log of a tracker into a run, as if it happened; wait for the run");
  add_door_options(app, *arguments, "log");
  app.add_option("LOG", arguments->log, "log of ARK or LARS")->required()->type_name("");
  app.add_option("--speed", arguments->speed, "how many times faster than it was logged")
      ->check(CLI::Range(0.001, 1000.0).description(""))
      ->capture_default_str()
      ->type_name("FACTOR");
  app.add_flag("--loop", arguments->loop, "begin again at the end, until interrupted");
  return {&app, [arguments] { return play(*arguments); }};
}

}  // namespace kilotwin::cli
