// `kilotwin export`: writes tables from a recorded run.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "clients/cli/commands.hpp"
#include "clients/cli/export_model.hpp"
#include "clients/cli/prepare.hpp"
#include "clients/cli/run_report.hpp"
#include "clients/identify/kilogrid/export_cells.hpp"
#include "clients/mcap/export_mcap.hpp"
#include "clients/recorder/export.hpp"
#include "clients/recorder/provenance.hpp"
#include "clients/recorder/summary.hpp"
#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "core/model/robot_parameters.hpp"
#include "core/os/files.hpp"
#include "core/plan/plan.hpp"

namespace kilotwin::cli {
namespace {

struct ExportArguments {
  std::filesystem::path run, trajectories, bodies, messages, radio, cells, mcap, model, report;
  std::filesystem::path variables, events, commands, observables, environment, pogosim;
  double every_s = 1;
  bool measured = false;
  std::vector<std::string> kinds;  ///< of events; empty: all
};

std::vector<proto::RecordedEvent> event_kinds(const std::vector<std::string>& names) {
  std::vector<proto::RecordedEvent> kinds;
  for (const std::string& name : names) {
    const auto kind = recorder::event_kind(name);
    if (!kind)
      throw UserError(fmt::format("--kind {}: is no kind of events; there are {}", name, recorder::kEventKinds));
    kinds.push_back(*kind);
  }
  return kinds;
}

/// Each robot's calibrated duties; empty if the directory has no manifest.
std::vector<recorder::CalibratedDuties> calibrated_duties(const recorder::RunDirectory& run) {
  if (!std::filesystem::exists(run.manifest())) return {};
  const RobotParameters parameters{RunPlan(read_manifest(run))};
  std::vector<recorder::CalibratedDuties> duties;
  for (std::uint32_t robot = 0; robot < parameters.robots(); ++robot) {
    const Calibration& own = parameters.calibration(robot);
    duties.push_back({own.turn_left, own.turn_right, own.straight_left, own.straight_right});
  }
  return duties;
}

/// The note on motions that no command of the table stands for; empty: there are none.
std::string other_duties_note(const recorder::OtherDuties& other) {
  if (other.changes == 0) return {};
  return fmt::format(
      "kilotwin: --commands: {} changes of motion, of {} robots, are to other duties than the calibrated ones; the "
      "table names them by the motors that run. The first: robot {} at {:.6g} s, duties {} and {}. "
      "--events FILE --kind motion has all duties",
      other.changes, other.robots, other.robot, other.time_s, other.left, other.right);
}

/// Facts about a table's run, for scripts.
recorder::TableMetadata metadata_of(const recorder::RunDirectory& directory) {
  recorder::TableMetadata about;
  const recorder::Reader reader(directory.recording());
  about.emplace_back("experiment", reader.header().name());
  about.emplace_back("seed", std::to_string(reader.header().seed()));
  about.emplace_back("run", fmt::format("{:016x}", reader.header().run()));
  if (std::filesystem::exists(directory.summary())) {
    about.emplace_back("state_hash",
                       fmt::format("{:016x}", recorder::read_summary(directory.summary()).state_hash));
  }
  if (const auto origin = recorder::read_provenance(directory.provenance())) {
    about.emplace_back("version", origin->version);
    about.emplace_back("build", origin->build);
    about.emplace_back("date", origin->date);
  }
  return about;
}

int export_run(const ExportArguments& arguments) {
  const std::vector<const std::filesystem::path*> tables{
      &arguments.trajectories, &arguments.bodies,      &arguments.messages, &arguments.radio,
      &arguments.cells,        &arguments.variables,   &arguments.events,   &arguments.commands,
      &arguments.observables,  &arguments.environment, &arguments.pogosim,  &arguments.mcap};
  const bool rows_wanted =
      std::any_of(tables.begin(), tables.end(), [](const auto* table) { return !table->empty(); });
  if (!rows_wanted && arguments.model.empty() && arguments.report.empty()) {
    throw UserError(
        "export: nothing to export; give --trajectories FILE, --variables FILE, --events FILE, --commands FILE, "
        "--observables FILE, --environment FILE, --bodies FILE, --messages FILE, --radio FILE, --cells FILE, "
        "--pogosim FILE, --mcap FILE, --model FILE, --report FILE or several; a table ends in .csv, .csv.gz, .npz "
        "or .arrow");
  }
  const std::vector<proto::RecordedEvent> kinds = event_kinds(arguments.kinds);
  if (arguments.report == "-") throw UserError("--report -: needs a file; give --report FILE.html");
  const bool to_output = std::any_of(tables.begin(), tables.end(), [](const auto* table) { return *table == "-"; });
  const auto note = [&](const std::string& line) { to_output ? say(line) : fmt::print("{}\n", line); };
  if (!arguments.model.empty()) {
    const auto run = recorder::RunDirectory::open(arguments.run, recorder::RunDirectory::Needs::kManifest);
    note(fmt::format("{}: {} robots", arguments.model.string(), export_model(read_manifest(run), arguments.model)));
  }
  if (!arguments.report.empty()) {
    const auto run = recorder::RunDirectory::open(arguments.run, recorder::RunDirectory::Needs::kManifest);
    os::write_file(arguments.report, run_report(run));
    note(fmt::format("{}: the page of the run", arguments.report.string()));
  }
  if (!rows_wanted) return kDone;
  if (arguments.mcap == "-") throw UserError("--mcap -: needs a file; give --mcap FILE.mcap");
  if (std::count_if(tables.begin(), tables.end(), [](const auto* table) { return *table == "-"; }) > 1)
    throw UserError("export: two tables to standard output; give a file for all but one");
  const auto directory = recorder::RunDirectory::open(arguments.run, recorder::RunDirectory::Needs::kRecording);
  const recorder::TableMetadata about = metadata_of(directory);
  bool damaged = false;
  const auto each = [&](const std::filesystem::path& file, auto&& write, const char* what = "rows") {
    if (file.empty()) return;
    recorder::Reader reader(directory.recording());
    const std::uint64_t rows = write(reader, file);
    if (!reader.warning().empty()) say("kilotwin: " + reader.warning());
    damaged = damaged || reader.damaged();
    if (file != "-") fmt::print("{}: {} {}\n", file.string(), rows, what);
  };
  using recorder::Reader;
  each(arguments.trajectories, [&](Reader& reader, const auto& file) {
    return recorder::export_trajectories(reader, file, arguments.every_s,
                                         arguments.measured ? recorder::Poses::kMeasured : recorder::Poses::kTrue,
                                         about);
  });
  each(arguments.pogosim, [&](Reader& reader, const auto& file) {
    return recorder::export_pogosim(reader, file, arguments.every_s, about);
  });
  each(arguments.bodies, [&](Reader& reader, const auto& file) {
    return recorder::export_bodies(reader, file, arguments.every_s, about);
  });
  each(arguments.messages,
       [&](Reader& reader, const auto& file) { return recorder::export_messages(reader, file, about); });
  each(arguments.radio,
       [&](Reader& reader, const auto& file) { return recorder::export_radio(reader, file, about); });
  each(arguments.variables,
       [&](Reader& reader, const auto& file) { return recorder::export_variables(reader, file, about); });
  each(arguments.events,
       [&](Reader& reader, const auto& file) { return recorder::export_events(reader, file, kinds, about); });
  each(arguments.commands, [&](Reader& reader, const auto& file) {
    const recorder::ExportedCommands commands =
        recorder::export_commands(reader, file, calibrated_duties(directory), about);
    if (const std::string text = other_duties_note(commands.other); !text.empty()) say(text);
    return commands.rows;
  });
  each(arguments.observables,
       [&](Reader& reader, const auto& file) { return recorder::export_observables(reader, file, about); });
  each(arguments.environment, [&](Reader& reader, const auto& file) {
    return recorder::export_environment(directory.path(), reader.header(), file, about);
  });
  each(arguments.cells, [&](Reader& reader, const auto& file) { return kilogrid::export_cells(reader, file); });
  each(
      arguments.mcap,
      [&](Reader& reader, const auto& file) { return mcap::export_mcap(reader, file, arguments.every_s); },
      "states");
  // A damaged recording is exported up to the damage.
  return damaged ? kFailed : kDone;
}

}  // namespace

Command add_export(CLI::App& program) {
  const auto arguments = std::make_shared<ExportArguments>();
  CLI::App& app = *program.add_subcommand("export",
                                          "write tables from a recorded run: FILE.csv, FILE.csv.gz, FILE.npz for "
                                          "NumPy, FILE.arrow, or - for standard output");
  app.add_option("RUN", arguments->run, "run directory or recording")->required()->type_name("");
  app.add_option("--trajectories", arguments->trajectories,
                 fmt::format("columns {}, and battery_V if it was recorded", recorder::kTrajectoryColumns))
      ->type_name("FILE");
  app.add_option("--variables", arguments->variables,
                 "recorded variables of programs: columns time_s,robot,group and one per variable")
      ->type_name("FILE");
  CLI::Option* const events =
      app.add_option(
             "--events", arguments->events,
             "recorded events: columns time_s,event,robot,group,led_r,led_g,led_b,motor_left,motor_right,state,"
             "sender,distance_mm,text")
          ->type_name("FILE");
  app.add_option(
         "--kind", arguments->kinds,
         fmt::format("with --events: events of this kind alone, with the columns that they have; several are "
                     "possible: {}",
                     recorder::kEventKinds))
      ->needs(events)
      ->allow_extra_args(false)
      ->type_name("KIND");
  app.add_option("--commands", arguments->commands,
                 "changes of motion, as `kilotwin identify` reads them: columns run,robot,time_s,motion")
      ->type_name("FILE");
  app.add_option("--observables", arguments->observables,
                 "observables over time: columns time_s, the experiment's own, msd_mm2, displacement_mm...")
      ->type_name("FILE");
  app.add_option("--environment", arguments->environment,
                 "logs of the station's environments: columns environment,name,time_s,robot,colour,x,y,"
                 "orientation_deg,value_1...")
      ->type_name("FILE");
  app.add_option("--bodies", arguments->bodies, "movable bodies: columns time_s,body,x_mm,y_mm,heading_rad")
      ->type_name("FILE");
  app.add_option("--messages", arguments->messages, fmt::format("columns {}", recorder::kMessageColumns))
      ->type_name("FILE");
  app.add_option("--radio", arguments->radio, "columns robot,attempted,sent,received,collided,backed_off")
      ->type_name("FILE");
  app.add_option("--cells", arguments->cells,
                 "positions as a floor of 50 mm cells measures them: columns time_s,robot,x_mm,y_mm")
      ->type_name("FILE");
  app.add_option("--pogosim", arguments->pogosim,
                 fmt::format("for programs that read pogosim's tables: columns {}, and recorded variables",
                             recorder::kPogosimColumns))
      ->type_name("FILE");
  app.add_option("--mcap", arguments->mcap, "for Foxglove, Lichtblick and Rerun: robots, bodies, counters, log")
      ->type_name("FILE");
  app.add_option("--every", arguments->every_s, "time between a robot's rows, or between states, s")
      ->capture_default_str()
      ->type_name("SECONDS");
  app.add_flag("--measured", arguments->measured,
               "trajectories as the tracker sees them: with the model's measurement effects");
  app.add_option("--model", arguments->model,
                 "the model as it ran, with each robot's own parameters; `run --model` reads it")
      ->type_name("FILE");
  app.add_option("--report", arguments->report,
                 "the page of the run, report.html, as `kilotwin run` writes it without --quiet")
      ->type_name("FILE");
  app.footer("Example: kilotwin export runs/disperse-1 --trajectories poses.csv");
  return {&app, [arguments] { return export_run(*arguments); }};
}

}  // namespace kilotwin::cli
