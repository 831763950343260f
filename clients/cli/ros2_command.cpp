// `kilotwin ros2`: a door between a run and ROS 2.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>

#include "clients/cli/commands.hpp"
#include "clients/cli/door_options.hpp"
#include "clients/doors/ros2/ros2_door.hpp"
#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "core/os/interrupt.hpp"

namespace kilotwin::cli {
namespace {

using doors::ros2::Discovery;
using doors::ros2::Ros2Door;

struct Ros2Arguments : DoorArguments {
  Discovery ros;
  std::optional<std::uint32_t> ros_domain;
  double seconds = 0;  ///< 0: until interrupted
};

constexpr std::int64_t kServe_ns = 100'000'000;
/// After so long without a frame, a line says what may be wrong.
constexpr double kPatience_s = 5;

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::string list_of(const std::vector<doors::ros2::ReadTopic>& topics) {
  constexpr std::size_t kShown = 3;
  std::string text;
  for (std::size_t i = 0; i < std::min(topics.size(), kShown); ++i) text += (i ? ", " : "") + topics[i].name;
  return topics.size() > kShown ? fmt::format("{} and {} more", text, topics.size() - kShown) : text;
}

void say_beginning(const Ros2Arguments& arguments, const proto::Door& door, const Ros2Door& work) {
  std::string line = fmt::format("kilotwin: door \"{}\" between ROS domain {} and the run on domain {}",
                                 one_line(door.name(), 64), arguments.ros.domain, arguments.run.domain);
  if (!work.topics().empty()) line += "; reads " + list_of(work.topics());
  const proto::Ros2Publish& publish = door.ros2().publish();
  if (publish.has_poses() || publish.clock()) {
    line += fmt::format("; publishes {}{}{}", publish.poses(), publish.has_poses() && publish.clock() ? ", " : "",
                        publish.clock() ? "/clock" : "");
  }
  say(line);
}

int serve(Ros2Arguments arguments) {
  catch_interrupts();
  const LoadedExperiment loaded = load_experiment(arguments.experiment);
  doors::Door door = doors::open_door(loaded, proto::Door::kRos2, arguments.door);
  const proto::Door settings = door.settings;
  arguments.ros.domain = arguments.ros_domain.value_or(settings.ros2().domain());
  if (arguments.ros.domain == arguments.run.domain) {
    throw UserError(fmt::format(
        "--domain: the run and ROS are both on domain {}; give the run a domain of its own, --domain N of both "
        "`kilotwin run` and `kilotwin ros2`",
        arguments.run.domain));
  }
  Ros2Door work(std::move(door), arguments.run, arguments.ros);
  say_beginning(arguments, settings, work);
  const double began_s = now_s();
  bool warned = work.topics().empty(), heard = false;
  while (interrupted() == 0 && (arguments.seconds == 0 || now_s() < began_s + arguments.seconds)) {
    work.serve(kServe_ns);
    if (!heard && work.tally().frames() > 0) {
      heard = true;
      say("kilotwin: the first tracker frame has come");
    }
    if (!heard && !warned && now_s() > began_s + kPatience_s) {
      warned = true;
      warn(
          fmt::format("kilotwin: no tracker frame within {} s ({}); compare ROS_DOMAIN_ID, topic and type, and see "
                      "docs/how-to/other-trackers.md about discovery",
                      kPatience_s, work.tally().in_words()));
    }
  }
  say(fmt::format("kilotwin: door \"{}\" closes: {}; published {} times", one_line(settings.name(), 64),
                  work.tally().in_words(), work.published()));
  return kDone;
}

}  // namespace

Command add_ros2(CLI::App& program) {
  const auto arguments = std::make_shared<Ros2Arguments>();
  CLI::App& app = *program.add_subcommand(
      "ros2", "a door to ROS 2: its poses of real robots enter a run, and it sees the run's robots");
  add_door_options(app, *arguments, "ros2");
  app.add_option("--ros-domain", arguments->ros_domain, "ROS_DOMAIN_ID (default: the door's)")
      ->check(CLI::Range(0u, dds::kLastDomain).description(""))
      ->type_name("N");
  app.add_flag("--ros-multicast", arguments->ros.multicast,
               "find nodes by multicast, as ROS does by default (default: on this machine alone, by unicast)");
  app.add_option("--ros-peer", arguments->ros.peers,
                 "address of a machine with nodes of ROS, to be found by unicast")
      ->allow_extra_args(false)
      ->type_name("ADDRESS");
  app.add_option("--ros-config", arguments->ros.configuration,
                 "configuration of Cyclone DDS for the ROS domain, as CYCLONEDDS_URI has it")
      ->excludes("--ros-multicast")
      ->excludes("--ros-peer")
      ->type_name("XML|URI");
  app.add_option("--seconds", arguments->seconds, "end after this time; 0: when interrupted")
      ->check(CLI::NonNegativeNumber.description(""))
      ->capture_default_str()
      ->type_name("S");
  return {&app, [arguments] { return serve(*arguments); }};
}

}  // namespace kilotwin::cli
