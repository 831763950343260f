// `kilotwin import`: an experiment file of an experiment of another simulator, or of a log of a tracker.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "clients/cli/commands.hpp"
#include "clients/importers/imported.hpp"
#include "clients/importers/pogosim_table.hpp"
#include "clients/importers/tracker_log.hpp"
#include "core/base/error.hpp"
#include "core/os/files.hpp"

namespace kilotwin::cli {
namespace {

namespace fs = std::filesystem;
using importers::Imported;

struct ImportArguments {
  fs::path file, out, behaviour;
  std::string format;
  std::optional<double> unit_mm;
  bool force = false;
};

/// The files to write: the experiment, then the files that belong to it.
using Files = std::vector<std::pair<fs::path, std::string>>;

void write_all(const Files& files, bool force) {
  for (const auto& [file, content] : files) {
    if (fs::exists(file) && !force)
      throw UserError(fmt::format("{}: exists; give another name with --out, or --force", file.string()));
  }
  for (const auto& [file, content] : files) {
    if (file.has_parent_path()) fs::create_directories(file.parent_path());
    os::write_file(file, content);
  }
}

Files files_of(const Imported& imported, const ImportArguments& arguments, const fs::path& out) {
  Files files{{out, importers::experiment_text(imported, arguments.file.filename().string())}};
  for (const importers::PosesFile& poses : imported.poses)
    files.emplace_back(out.parent_path() / poses.name, poses.text);
  return files;
}

bool is_table(const std::string& ending) { return ending == ".csv" || ending == ".feather" || ending == ".arrow"; }

bool is_log(const std::string& ending) { return ending == ".tsv" || ending == ".txt" || ending == ".log"; }

void import_log(const ImportArguments& arguments, const fs::path& out) {
  if (!arguments.behaviour.empty()) throw UserError("--behaviour: a log has no program; its robots are real ones");
  importers::LogOptions options;
  options.unit_mm = arguments.unit_mm;
  if (!arguments.format.empty())
    options.format = arguments.format == "lars" ? proto::LogDoor::LARS : proto::LogDoor::ARK;
  const importers::ImportedLog log = importers::from_tracker_log(arguments.file, options);
  const fs::path tracks = out.parent_path() / (out.stem().string() + "-tracks");
  Files files = files_of(log.imported, arguments, out);
  files.emplace_back(tracks / "trajectories.csv", log.tracks);
  write_all(files, arguments.force);
  for (const std::string& note : log.imported.notes) fmt::print("{}: {}\n", arguments.file.string(), note);
  fmt::print("{0}: written, with {1} robots\n{2}: written. Next: kilotwin identify --train {3}\n", out.string(),
             log.imported.experiment.robots(0).count(), files.back().first.string(), tracks.string());
  fmt::print(
      "To play the log into a run: kilotwin run {0} --pace 1 --domain 5, and beside it kilotwin play {0} {1} "
      "--domain 5\n",
      out.string(), arguments.file.string());
}

/// The program's path as the experiment file names it: from its own folder. Throws UserError where there is no such file.
std::string behaviour_beside(const fs::path& behaviour, const fs::path& out) {
  if (!fs::is_regular_file(behaviour))
    throw UserError(fmt::format("--behaviour: {}: there is no such file in {}", behaviour.string(),
                                fs::absolute(behaviour).parent_path().string()));
  if (behaviour.is_absolute()) return behaviour.string();
  return fs::proximate(fs::absolute(behaviour), fs::absolute(out).parent_path()).string();
}

void set_behaviours(const ImportArguments& arguments, const fs::path& out, proto::Experiment& experiment) {
  if (arguments.behaviour.empty()) return;
  for (proto::RobotGroup& group : *experiment.mutable_robots())
    group.set_behaviour(0, behaviour_beside(arguments.behaviour, out));
}

void refuse_options_of_logs(const ImportArguments& arguments) {
  if (!arguments.format.empty() || arguments.unit_mm)
    throw UserError("--format and --unit-mm: are for logs of trackers");
}

void import_table(const ImportArguments& arguments, const fs::path& out) {
  refuse_options_of_logs(arguments);
  importers::ImportedTable table = importers::from_pogosim_table(arguments.file);
  set_behaviours(arguments, out, table.imported.experiment);
  const fs::path tracks = out.parent_path() / (out.stem().string() + "-tracks");
  Files files = files_of(table.imported, arguments, out);
  files.emplace_back(tracks / "trajectories.csv", table.tracks);
  write_all(files, arguments.force);
  for (const std::string& note : table.imported.notes) fmt::print("{}: {}\n", arguments.file.string(), note);
  fmt::print(
      "{0}: written, with {1} table{2} of poses. Next: kilotwin check {0}\n{3}: written. Next: kilotwin identify "
      "--train {4}\n",
      out.string(), table.imported.poses.size(), table.imported.poses.size() == 1 ? "" : "s",
      files.back().first.string(), tracks.string());
}

void import_experiment(const ImportArguments& arguments, const fs::path& out, const std::string& ending) {
  const bool yaml = ending == ".yaml" || ending == ".yml";
  refuse_options_of_logs(arguments);
  const std::string text = os::read_file(arguments.file), name = arguments.file.string();
  // pogosim takes paths from the folder where it runs, which need not be that of the configuration.
  const auto read_beside = [&](const std::string& file) {
    const auto beside = os::read_if_there(arguments.file.parent_path() / file);
    return beside ? beside : os::read_if_there(file);
  };
  Imported imported = ending == ".json" ? importers::from_kilombo(text, name)
                      : yaml            ? importers::from_pogosim(text, name, read_beside)
                                        : importers::from_argos(text, name);
  set_behaviours(arguments, out, imported.experiment);
  write_all(files_of(imported, arguments, out), arguments.force);
  for (const std::string& note : imported.notes) fmt::print("{}:{}{}\n", name, ending == ".json" ? " " : "", note);
  fmt::print("{}: written{}. Next: kilotwin check {}\n", out.string(),
             imported.poses.empty() ? ""
                                    : fmt::format(", with {} table{} of poses", imported.poses.size(),
                                                  imported.poses.size() == 1 ? "" : "s"),
             out.string());
}

int import_file(const ImportArguments& arguments) {
  const std::string ending = arguments.file.extension().string();
  const bool known =
      ending == ".argos" || ending == ".xml" || ending == ".json" || ending == ".yaml" || ending == ".yml";
  if (!known && !is_log(ending) && !is_table(ending))
    throw UserError(fmt::format(
        "{}: is of no known kind; give an .argos file, a .json file of Kilombo, a .yaml file or a table "
        "(.feather, .csv) of pogosim, or a log of ARK or LARS that ends in .tsv, .txt or .log",
        arguments.file.string()));
  fs::path out = arguments.out;
  if (out.empty()) out = fs::path(arguments.file).replace_extension(".txtpb").filename();
  if (is_log(ending))
    import_log(arguments, out);
  else if (is_table(ending))
    import_table(arguments, out);
  else
    import_experiment(arguments, out, ending);
  return kDone;
}

}  // namespace

Command add_import(CLI::App& program) {
  const auto arguments = std::make_shared<ImportArguments>();
  CLI::App& app = *program.add_subcommand("import",
                                          "make an experiment file of an .argos file, of Kilombo's JSON, of "
                                          "pogosim's YAML or its tables, or of a tracker's "
                                          "log");
  app.add_option(
         "FILE", arguments->file,
         "an .argos file, a .json file of Kilombo, a .yaml file or a table (.feather, .csv) of pogosim, or a log "
         "(.tsv, .txt, .log) of ARK or LARS")
      ->required()
      ->check(CLI::ExistingFile.description(""));
  app.add_option("-o,--out", arguments->out, "the experiment file (default: FILE's name with .txtpb, here)")
      ->type_name("FILE");
  app.add_option("--behaviour", arguments->behaviour,
                 "the robots' program in C (default: named after the compiled one)")
      ->type_name("FILE");
  app.add_option("--format", arguments->format, "of a log: ark or lars (default: its first line tells)")
      ->check(CLI::IsMember({"ark", "lars"}).description(""))
      ->type_name("NAME");
  app.add_option("--unit-mm", arguments->unit_mm, "of a log: length of a pixel, mm; LARS needs it (default: 1)")
      ->check(CLI::Range(0.001, 1000.0).description(""))
      ->type_name("MM");
  app.add_flag("--force", arguments->force, "replace files that exist");
  app.footer("Example: kilotwin import gather.argos. It prints what has no counterpart, with the line.");
  return {&app, [arguments] { return import_file(*arguments); }};
}

}  // namespace kilotwin::cli
