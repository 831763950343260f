// The program `kilotwin`: arguments in, exit status out. Every command is a function of its own file.

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <chrono>
#include <filesystem>
#include <limits>

#include "services/behaviours/compiler.hpp"
#include "services/behaviours/robot_warnings.hpp"
#include "clients/cli/doctor_command.hpp"
#include "clients/cli/export_model.hpp"
#include "clients/cli/identify_command.hpp"
#include "clients/cli/prepare.hpp"
#include "clients/cli/replay_command.hpp"
#include "clients/cli/run_command.hpp"
#include "clients/cli/service_command.hpp"
#include "clients/cli/sweep_command.hpp"
#include "clients/identify/kilogrid/export_cells.hpp"
#include "clients/recorder/export.hpp"
#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "core/dds/dds.hpp"
#include "core/experiment/validate.hpp"

namespace kilotwin::cli {
namespace {

constexpr int kFailed = 1, kBadInput = 2;

/// A seed is decimal, whatever zeros are before it; what does not fit would be another seed than the one asked for.
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

void add_experiment_options(CLI::App& app, RunArguments& arguments) {
  app.add_option("experiment", arguments.experiment, "experiment file (*.txtpb)")->required();
  app.add_option("--duration", arguments.duration_s, "simulated time, s");
  app.add_option("--robots", arguments.robots, "replaces the first robot group's count");
  app.add_option("--behaviour", arguments.behaviour,
                 "replaces the first robot group's program (.c, .so, .elf or .hex)");
  app.add_option("--define", arguments.define, "NAME=VALUE: a macro for programs that are compiled")
      ->allow_extra_args(false);
  app.add_option("--model", arguments.model, "model of motion (*.txtpb) in place of the experiment's");
}

void add_run(CLI::App& app, RunArguments& arguments) {
  add_experiment_options(app, arguments);
  app.add_option("--mode", arguments.mode, "federated: services as processes over DDS; local: all in this process")
      ->check(CLI::IsMember({"local", "federated"}))
      ->capture_default_str();
  app.add_option("--partitions", arguments.partitions, "COLUMNSxROWS of physics partitions");
  app.add_option("--hosts", arguments.hosts, "hosts of behaviours, each with a share of the robots");
  app.add_option("--threads", arguments.threads, "threads of a local run")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  app.add_option("--seed", arguments.seed, "seed of all randomness")
      ->transform(CLI::Validator(decimal_seed, "UINT"));
  app.add_option("--set", arguments.set, "FIELD=VALUE, e.g. robots[0].layout.grid.pitch_mm=33")
      ->allow_extra_args(false);
  app.add_option("--pace", arguments.pace, "max, or a factor of real time")->capture_default_str();
  app.add_option("--checkpoint-every", arguments.checkpoint_every_s, "simulated time between checkpoints, s");
  app.add_option("--resume", arguments.resume, "start from the newest checkpoint of that run");
  app.add_flag("--prepare", arguments.prepare, "write the run directory for services started by hand, and stop");
  app.add_option("--domain", arguments.domain, "DDS domain (default: a free one)");
  app.add_option("--out", arguments.out, "run directory (default: runs/NAME-SEED)");
  app.add_flag("--quiet", arguments.quiet, "no progress and no summary on the screen");
}

struct BuildArguments {
  std::vector<std::filesystem::path> sources;
  std::filesystem::path out;
  std::vector<std::string> define;
  bool avr = false;
};

int build_command(const BuildArguments& arguments) {
  behaviours::CompileOptions options;
  options.defines = arguments.define;
  if (arguments.avr) {
    if (!arguments.out.empty()) {
      const behaviours::CompiledProgram linked = behaviours::compile_firmware(arguments.sources, options);
      std::error_code error;
      std::filesystem::copy_file(linked.file, arguments.out, std::filesystem::copy_options::overwrite_existing,
                                 error);
      if (error) throw UserError(fmt::format("{}: cannot be written: {}", arguments.out.string(), error.message()));
      fmt::print("{}\n", arguments.out.string());
    }
    constexpr double kFlash = 32768, kRam = 2048;
    const behaviours::AvrSize size = behaviours::compile_for_avr(arguments.sources, options);
    fmt::print(
        "ATmega328P: {} octets of flash ({:.1f} % of 32 KiB), {} octets of RAM ({:.1f} % of 2 KiB), without "
        "kilolib and the stack\n",
        size.flash_octets, 100 * size.flash_octets / kFlash, size.ram_octets, 100 * size.ram_octets / kRam);
    return 0;
  }
  const behaviours::CompiledProgram compiled = behaviours::compile(arguments.sources, options);
  for (const std::string& note : compiled.notes) say("note: " + note);
  if (arguments.sources.front().extension() != ".so") {
    for (const std::string& warning : behaviours::robot_warnings(arguments.sources, options)) say(warning);
  }
  const std::filesystem::path out =
      arguments.out.empty() ? arguments.sources.front().stem().string() + ".so" : arguments.out.string();
  std::error_code error;
  std::filesystem::copy_file(compiled.file, out, std::filesystem::copy_options::overwrite_existing, error);
  if (error) throw UserError(fmt::format("{}: cannot be written: {}", out.string(), error.message()));
  fmt::print("{}\n", out.string());
  return 0;
}

struct ExportArguments {
  std::filesystem::path run, trajectories, bodies, messages, radio, cells, model;
  double every_s = 1;
  bool measured = false;
};

int export_command(const ExportArguments& arguments) {
  const bool rows_wanted = !arguments.trajectories.empty() || !arguments.bodies.empty() ||
                           !arguments.messages.empty() || !arguments.radio.empty() || !arguments.cells.empty();
  if (!rows_wanted && arguments.model.empty()) {
    throw UserError(
        "export: nothing to export; give --trajectories FILE.csv, --bodies FILE.csv, --messages FILE.csv, "
        "--radio FILE.csv, --cells FILE.csv, --model FILE.txtpb or several");
  }
  if (!arguments.model.empty()) {
    const auto run = recorder::RunDirectory::open(arguments.run, recorder::RunDirectory::Needs::kManifest);
    fmt::print("{}: {} robots\n", arguments.model.string(), export_model(read_manifest(run), arguments.model));
    if (!rows_wanted) return 0;
  }
  const auto directory = recorder::RunDirectory::open(arguments.run, recorder::RunDirectory::Needs::kRecording);
  const auto each = [&](const std::filesystem::path& csv, auto&& write) {
    if (csv.empty()) return;
    recorder::Reader reader(directory.recording());
    const std::uint64_t rows = write(reader, csv);
    if (!reader.warning().empty()) say("kilotwin: " + reader.warning());
    fmt::print("{}: {} rows\n", csv.string(), rows);
  };
  each(arguments.trajectories, [&](recorder::Reader& reader, const auto& csv) {
    return recorder::export_trajectories(reader, csv, arguments.every_s,
                                         arguments.measured ? recorder::Poses::kMeasured : recorder::Poses::kTrue);
  });
  each(arguments.bodies, [&](recorder::Reader& reader, const auto& csv) {
    return recorder::export_bodies(reader, csv, arguments.every_s);
  });
  each(arguments.messages,
       [&](recorder::Reader& reader, const auto& csv) { return recorder::export_messages(reader, csv); });
  each(arguments.radio,
       [&](recorder::Reader& reader, const auto& csv) { return recorder::export_radio(reader, csv); });
  each(arguments.cells,
       [&](recorder::Reader& reader, const auto& csv) { return kilogrid::export_cells(reader, csv); });
  return 0;
}

int main_of(int argc, char** argv) {
  const double started_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  CLI::App app{"Kilotwin: one experiment of simulated and real Kilobots, as services over DDS"};
  app.name("kilotwin");
  app.require_subcommand(1);
  app.set_version_flag("--version", KILOTWIN_VERSION);

  RunArguments run;
  CLI::App& run_app = *app.add_subcommand("run", "run an experiment to its end");
  add_run(run_app, run);

  RunArguments check;
  CLI::App& check_app = *app.add_subcommand("check", "validate an experiment; prints nothing when it is right");
  add_experiment_options(check_app, check);
  check_app.add_option("--set", check.set, "FIELD=VALUE")->allow_extra_args(false);

  ServiceArguments service;
  CLI::App& service_app = *app.add_subcommand("service", "run one service in the foreground");
  service_app.add_option("service", service.service, "physics, comm, station or behaviours")
      ->required()
      ->check(CLI::IsMember({"physics", "comm", "station", "behaviours"}));
  service_app.add_option("--run", service.run, "directory that `kilotwin run --prepare` wrote")->required();
  service_app.add_option("--partition", service.partition,
                         "physics: COLUMN,ROW, counted from 0 at the bottom left");
  service_app.add_option("--share", service.share, "behaviours: I/N, counted from 1");
  service_app.add_option("--domain", service.domain, "DDS domain, the same for all services of a run")
      ->check(CLI::Range(0u, dds::kLastDomain))
      ->capture_default_str();
  service_app
      .add_option("--peer", service.peers,
                  "address of a machine that takes part, this one included; none: all on this machine")
      ->allow_extra_args(false);
  service_app.add_option("--start-monotonic", service.start_monotonic_s, "when the run was asked for")->group("");

  SweepArguments sweep;
  CLI::App& sweep_app = *app.add_subcommand("sweep", "many local runs on all cores, one table and a plot");
  add_experiment_options(sweep_app, sweep.run);
  sweep_app.add_option("--seeds", sweep.seeds, "FIRST..LAST");
  sweep_app.add_option("--set", sweep.set, "FIELD=V1,V2,... or FIELD=A..B: all combinations")
      ->allow_extra_args(false);
  sweep_app.add_option(
      "--plot", sweep.plot,
      "what plots show: msd, displacement, spread, nearest, polarisation or pushed (default: pushed "
      "where there are movable bodies, else msd)");
  sweep_app.add_option("--jobs", sweep.jobs, "runs at a time (default: one per core)");
  sweep_app.add_option("--out", sweep.out, "directory (default: runs/NAME-sweep)");

  BuildArguments build;
  CLI::App& build_app =
      *app.add_subcommand("build", "build a behaviour for simulation, or check it for the real robot");
  build_app.add_option("program", build.sources, "C sources")->required();
  build_app.add_option("-o", build.out, "shared object to write (default: PROGRAM.so here)");
  build_app.add_option("--define", build.define, "NAME=VALUE")->allow_extra_args(false);
  build_app.add_flag("--avr", build.avr,
                     "compile for the ATmega328P and print flash and RAM; with -o, link with a kilolib that runs "
                     "on the robot, as .elf");

  ExportArguments exported;
  CLI::App& export_app = *app.add_subcommand("export", "CSV files from a recorded run");
  export_app.add_option("run", exported.run, "run directory or recording")->required();
  export_app.add_option("--trajectories", exported.trajectories, "time_s,robot,x_mm,y_mm,heading_rad,led");
  export_app.add_option("--bodies", exported.bodies, "movable bodies: time_s,body,x_mm,y_mm,heading_rad");
  export_app.add_option("--messages", exported.messages, "receiver,sender,count");
  export_app.add_option("--radio", exported.radio, "robot,attempted,sent,received,collided,backed_off");
  export_app.add_option("--cells", exported.cells,
                        "as a floor of 50 mm cells hears robots: time_s,robot,x_mm,y_mm");
  export_app.add_option("--every", exported.every_s, "between rows of a robot, s")->capture_default_str();
  export_app.add_flag("--measured", exported.measured,
                      "trajectories as the tracker sees them, with the model's effects on it");
  export_app.add_option("--model", exported.model,
                        "the model as it ran, with every robot's own parameters; run --model reads it");

  std::filesystem::path replayed;
  bool verify = false, replay_quiet = false;
  CLI::App& replay_app = *app.add_subcommand("replay", "step a recorded run again");
  replay_app.add_option("run", replayed, "run directory")->required();
  replay_app.add_flag("--verify", verify, "compare every tick's state hash")->required();
  replay_app.add_flag("--quiet", replay_quiet, "nothing on the screen");

  IdentifyArguments identified;
  CLI::App& identify_app =
      *app.add_subcommand("identify", "why measured robots differ from the model, put into the model");
  identify_app.add_option("--train", identified.train, "directory of measured data to fit to")->required();
  identify_app.add_option("--test", identified.test,
                          "directory to predict, never fitted to (default: a part of --train that is held out)");
  identify_app.add_option("--out", identified.out, "directory to write to")->capture_default_str();
  identify_app.add_option("--horizon", identified.horizon_s, "how far ahead to predict, s")->capture_default_str();
  identify_app.add_option("--threads", identified.threads, "threads to work on")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  identify_app.add_flag("--quiet", identified.quiet, "no progress and no summary on the screen");

  std::optional<std::uint32_t> doctor_domain;
  CLI::App& doctor_app =
      *app.add_subcommand("doctor", "what on this machine would keep an experiment from running");
  doctor_app.add_option("--domain", doctor_domain, "the DDS domain to look at");

  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& success) {
    return app.exit(success);
  } catch (const CLI::ParseError& error) {
    const std::vector<CLI::App*> commands = app.get_subcommands();
    if (commands.empty() && argc > 1 && argv[1][0] != '-') {
      std::string known;
      for (const CLI::App* command : app.get_subcommands({}))
        known += (known.empty() ? "" : ", ") + command->get_name();
      say(fmt::format("kilotwin: \"{}\" is no command; there are {}; see kilotwin --help", argv[1], known));
    } else {
      say(fmt::format("kilotwin: {}; see kilotwin{} --help", error.what(),
                      commands.empty() ? "" : " " + commands.front()->get_name()));
    }
    return kBadInput;
  }

  if (run_app.parsed()) return run_command(run, started_s);
  if (check_app.parsed()) {
    validate(load_with_overrides(check));
    return 0;
  }
  if (service_app.parsed()) return service_command(service);
  if (sweep_app.parsed()) return sweep_command(sweep);
  if (build_app.parsed()) return build_command(build);
  if (export_app.parsed()) return export_command(exported);
  if (replay_app.parsed()) return replay_command(replayed, replay_quiet);
  if (identify_app.parsed()) return identify_command(identified);
  return doctor_command(doctor_domain);
}

}  // namespace
}  // namespace kilotwin::cli

int main(int argc, char** argv) {
  using namespace kilotwin;
  // A descriptor of these that is closed would go to the next file opened, and that file would get what is said.
  for (int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(fd, F_GETFD) < 0 && open("/dev/null", O_RDWR) < 0) return cli::kFailed;
  }
  try {
    return cli::main_of(argc, argv);
  } catch (const UserError& error) {
    say(error.what());
    return cli::kBadInput;
  } catch (const std::exception& error) {
    say(fmt::format("kilotwin: {}", error.what()));
    return cli::kFailed;
  }
}
