// `kilotwin export`: writes tables from a recorded run.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <memory>

#include "clients/cli/commands.hpp"
#include "clients/cli/export_model.hpp"
#include "clients/cli/prepare.hpp"
#include "clients/identify/kilogrid/export_cells.hpp"
#include "clients/mcap/export_mcap.hpp"
#include "clients/recorder/export.hpp"
#include "core/base/error.hpp"
#include "core/base/say.hpp"

namespace kilotwin::cli {
namespace {

struct ExportArguments {
  std::filesystem::path run, trajectories, bodies, messages, radio, cells, mcap, model;
  double every_s = 1;
  bool measured = false;
};

int export_run(const ExportArguments& arguments) {
  const bool rows_wanted = !arguments.trajectories.empty() || !arguments.bodies.empty() ||
                           !arguments.messages.empty() || !arguments.radio.empty() || !arguments.cells.empty() ||
                           !arguments.mcap.empty();
  if (!rows_wanted && arguments.model.empty()) {
    throw UserError(
        "export: nothing to export; give --trajectories FILE.csv, --bodies FILE.csv, --messages FILE.csv, "
        "--radio FILE.csv, --cells FILE.csv, --mcap FILE.mcap, --model FILE.txtpb or several");
  }
  if (!arguments.model.empty()) {
    const auto run = recorder::RunDirectory::open(arguments.run, recorder::RunDirectory::Needs::kManifest);
    fmt::print("{}: {} robots\n", arguments.model.string(), export_model(read_manifest(run), arguments.model));
    if (!rows_wanted) return kDone;
  }
  const auto tables = {&arguments.trajectories, &arguments.bodies, &arguments.messages, &arguments.radio,
                       &arguments.cells};
  if (arguments.mcap == "-") throw UserError("--mcap -: needs a file; give --mcap FILE.mcap");
  if (std::count_if(tables.begin(), tables.end(), [](const auto* table) { return *table == "-"; }) > 1)
    throw UserError("export: two tables to standard output; give a file for all but one");
  const auto directory = recorder::RunDirectory::open(arguments.run, recorder::RunDirectory::Needs::kRecording);
  bool damaged = false;
  const auto each = [&](const std::filesystem::path& csv, auto&& write, const char* what = "rows") {
    if (csv.empty()) return;
    recorder::Reader reader(directory.recording());
    const std::uint64_t rows = write(reader, csv);
    if (!reader.warning().empty()) say("kilotwin: " + reader.warning());
    damaged = damaged || reader.damaged();
    if (csv != "-") fmt::print("{}: {} {}\n", csv.string(), rows, what);
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
  each(
      arguments.mcap,
      [&](recorder::Reader& reader, const auto& file) {
        return mcap::export_mcap(reader, file, arguments.every_s);
      },
      "states");
  // A damaged recording is exported up to the damage.
  return damaged ? kFailed : kDone;
}

}  // namespace

Command add_export(CLI::App& program) {
  const auto arguments = std::make_shared<ExportArguments>();
  CLI::App& app = *program.add_subcommand(
      "export", "write tables (CSV) from a recorded run; FILE.csv.gz is gzipped, - is standard output");
  app.add_option("RUN", arguments->run, "run directory or recording")->required()->type_name("");
  app.add_option("--trajectories", arguments->trajectories, fmt::format("columns {}", recorder::kTrajectoryColumns))
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
  app.footer("Example: kilotwin export runs/disperse-1 --trajectories poses.csv");
  return {&app, [arguments] { return export_run(*arguments); }};
}

}  // namespace kilotwin::cli
