// `kilotwin service`: one service in the foreground.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "clients/cli/commands.hpp"
#include "clients/cli/prepare.hpp"
#include "clients/cli/recovery.hpp"
#include "clients/cli/run_recorder.hpp"
#include "core/base/build_identity.hpp"
#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "core/os/interrupt.hpp"
#include "core/os/limits.hpp"
#include "core/os/precedence.hpp"
#include "core/os/worker_pool.hpp"
#include "services/ark/station_service.hpp"
#include "services/behaviours/behaviours_service.hpp"
#include "services/comm/firmware/firmware_swarm.hpp"
#include "services/comm/radio_service.hpp"
#include "services/physics/physics_service.hpp"

namespace kilotwin::cli {
namespace {

struct ServiceArguments {
  std::string service;        ///< physics, comm, station, behaviours
  std::filesystem::path run;  ///< a directory that `run --prepare` wrote
  std::string partition;      ///< physics: "C,R"
  std::string share;          ///< behaviours: "I/N"
  dds::Transport transport;
  MonitorOptions monitor;      ///< of the station
  double give_up_after_s = 0;  ///< longest wait for others without progress; 0: no limit
  bool realtime = false;
  double started_s = 0;  ///< start time of the user's command, steady clock, s; for start_s of the summary
};

/// Upper limit of a service's open files and sockets.
constexpr std::uint64_t kServiceFiles = 64;

/// Parses "A<separator>B" with two numbers.
std::optional<std::pair<std::uint32_t, std::uint32_t>> two_numbers(const std::string& text, char separator) {
  std::uint32_t a = 0, b = 0;
  const char* const last = text.data() + text.size();
  const auto [middle, error] = std::from_chars(text.data(), last, a);
  if (error != std::errc() || middle == last || *middle != separator) return std::nullopt;
  const auto [end, second_error] = std::from_chars(middle + 1, last, b);
  if (second_error != std::errc() || end != last) return std::nullopt;
  return std::pair{a, b};
}

PartitionId parse_partition(const std::string& text, const PartitionGrid& grid) {
  if (text.empty() && grid.size() == 1) return PartitionId{0};
  const auto place = two_numbers(text, ',');
  if (!place || place->first >= grid.columns() || place->second >= grid.rows()) {
    throw UserError(
        fmt::format("--partition: \"{}\" is not one of this run's {}x{} partitions; give COLUMN,ROW counted from 0",
                    text, grid.columns(), grid.rows()));
  }
  return PartitionId{place->second * grid.columns() + place->first};
}

HostId parse_share(const std::string& text, std::uint32_t hosts) {
  if (text.empty() && hosts == 1) return HostId{0};
  const auto share = two_numbers(text, '/');
  if (!share || share->second != hosts || share->first < 1 || share->first > hosts) {
    throw UserError(
        fmt::format("--share: \"{}\" is no share of this run, which has {} hosts; give I/{} with I from 1 to {}",
                    text, hosts, hosts, hosts));
  }
  return HostId{share->first - 1};
}

/// Throws UserError if another build prepared the run, because its results could differ.
void require_this_build(const RunPlan& plan, const recorder::RunDirectory& directory) {
  if (plan.build == build_identity()) return;
  throw UserError(
      fmt::format("{}: prepared by build {} of kilotwin, and this is build {}; run one build everywhere, or "
                  "prepare the run again "
                  "with this one",
                  directory.manifest().string(), plan.build.empty() ? "(unnamed)" : plan.build, build_identity()));
}

/// Throws UserError unless all addresses are IPv4 addresses or host names.
void require_peers(const std::vector<std::string>& peers) {
  for (const std::string& peer : peers) {
    if (peer.empty() || peer.find(':') != std::string::npos)
      throw UserError(fmt::format(
          "--peer: \"{}\" is no IPv4 address; services meet over IPv4, for example --peer 192.168.1.5", peer));
  }
}

void run_station(const RunPlan& plan, const ServiceContext& context, const recorder::RunDirectory& directory,
                 const MonitorOptions& monitor, double started_s) {
  RunRecorder run_recorder(plan, directory, context.resumed, {});
  if (monitor.on) run_recorder.monitor(monitor);
  const RunTotals totals = ark::run_service(plan, context, run_recorder);
  const double first_tick_s =
      std::chrono::duration<double>(run_recorder.first_tick_at().time_since_epoch()).count();
  run_recorder.finish(totals, first_tick_s > 0 ? first_tick_s - started_s : 0);
  if (!totals.failure.empty()) throw RunError(totals.failure);
}

/// Directs all further lines of this process to the federate's log.
void begin_log(const RunPlan& plan, FederateId self, const dds::Transport& transport) {
  log_as(plan.name(self));
  say(fmt::format("starts: run {}, seed {}, domain {}", plan.experiment_name(), plan.seed(), transport.domain));
}

int serve(const ServiceArguments& arguments) {
  if (arguments.monitor.on && arguments.service != "station")
    throw UserError("--monitor: the station watches; give it to the service station");
  catch_interrupts();
  if (arguments.realtime && !os::take_precedence()) {
    warn(
        "kilotwin: --realtime: this user may not have real-time priority; allow it by `ulimit -r 1` or as root, or "
        "leave --realtime away");
  }
  require_peers(arguments.transport.peers);
  require_open_files(kServiceFiles, "a service");
  const auto directory = recorder::RunDirectory::open(arguments.run, recorder::RunDirectory::Needs::kManifest);
  const RunPlan plan(read_manifest(directory));
  require_this_build(plan, directory);
  ServiceContext context;
  context.transport = arguments.transport;
  context.run_directory = directory.path();
  context.give_up_after_s = arguments.give_up_after_s;
  Beginning beginning = beginning_of(plan, directory);
  context.resumed = std::move(beginning.resumed);
  context.inputs = std::move(beginning.inputs);
  if (arguments.service == "station") context.tracker_samples = std::move(beginning.tracker_samples);

  if (arguments.service == "physics") {
    const PartitionId partition = parse_partition(arguments.partition, plan.grid);
    begin_log(plan, plan.physics(partition), arguments.transport);
    physics::run_service(plan, partition, context);
  } else if (arguments.service == "comm") {
    begin_log(plan, plan.radio(), arguments.transport);
    comm::run_service(plan, context,
                      firmware::make_firmware_robots(plan, directory.path(), os::cores(), context.first(), true));
  } else if (arguments.service == "behaviours") {
    const HostId host = parse_share(arguments.share, plan.hosts);
    begin_log(plan, plan.behaviours(host), arguments.transport);
    behaviours::run_service(plan, host, context);
  } else {
    begin_log(plan, plan.station(), arguments.transport);
    run_station(plan, context, directory, arguments.monitor, arguments.started_s);
  }
  say("ended: the run is over");
  return kDone;
}

/// Validator of the argument SERVICE. `radio` and `comm` both name the radio. Returns an error text or "".
std::string service_name(std::string& name) {
  if (name == "radio") name = "comm";
  for (const char* known : {"physics", "comm", "station", "behaviours"}) {
    if (name == known) return {};
  }
  return fmt::format("there is no service \"{}\"; give physics, comm (the radio), station or behaviours", name);
}

}  // namespace

Command add_service(CLI::App& program, double started_s) {
  const auto arguments = std::make_shared<ServiceArguments>();
  arguments->started_s = started_s;
  CLI::App& app =
      *program.add_subcommand("service", "run one service in the foreground, for runs over several machines");
  app.add_option("SERVICE", arguments->service, "physics, comm (the radio), station or behaviours")
      ->required()
      ->transform(CLI::Validator(service_name, ""))
      ->type_name("");
  app.add_option("--run", arguments->run, "directory that `kilotwin run --prepare` wrote")
      ->required()
      ->type_name("DIR");
  app.add_option("--partition", arguments->partition, "physics: column and row, counted from 0 at the bottom left")
      ->type_name("C,R");
  app.add_option("--share", arguments->share, "behaviours: host I of N, counted from 1")->type_name("I/N");
  app.add_option("--domain", arguments->transport.domain, "DDS domain, the same for all services of a run")
      ->check(CLI::Range(0u, dds::kLastDomain).description(""))
      ->capture_default_str()
      ->type_name("N");
  app.add_option("--peer", arguments->transport.peers,
                 "address of a machine that takes part; give each of them, this machine too (default: all on this "
                 "machine)")
      ->allow_extra_args(false)
      ->type_name("ADDRESS");
  app.add_option("--give-up-after", arguments->give_up_after_s,
                 "end after it has waited so long for others without progress; 0: never")
      ->check(CLI::NonNegativeNumber.description(""))
      ->capture_default_str()
      ->type_name("SECONDS");
  app.add_flag("--realtime", arguments->realtime, "take precedence over other programs of the machine");
  add_monitor_options(app, arguments->monitor);
  app.add_option("--start-monotonic", arguments->started_s, "when the run was asked for")->group("");
  return {&app, [arguments] { return serve(*arguments); }};
}

}  // namespace kilotwin::cli
