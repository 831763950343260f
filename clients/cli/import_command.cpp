// `kilotwin import`: an experiment file of an experiment of another simulator.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>

#include "clients/cli/commands.hpp"
#include "clients/importers/imported.hpp"
#include "core/base/error.hpp"
#include "core/os/files.hpp"

namespace kilotwin::cli {
namespace {

struct ImportArguments {
  std::filesystem::path file, out, behaviour;
  bool force = false;
};

int import_file(const ImportArguments& arguments) {
  const std::string ending = arguments.file.extension().string();
  const bool yaml = ending == ".yaml" || ending == ".yml";
  if (ending != ".argos" && ending != ".xml" && ending != ".json" && !yaml)
    throw UserError(fmt::format(
        "{}: is of no known kind; give an .argos file, a .json file of Kilombo or a .yaml file of pogosim",
        arguments.file.string()));
  const std::string text = os::read_file(arguments.file), name = arguments.file.string();
  importers::Imported imported = ending == ".json" ? importers::from_kilombo(text, name)
                                 : yaml            ? importers::from_pogosim(text, name)
                                                   : importers::from_argos(text, name);
  if (!arguments.behaviour.empty()) {
    for (proto::RobotGroup& group : *imported.experiment.mutable_robots())
      group.set_behaviour(0, arguments.behaviour.string());
  }
  std::filesystem::path out = arguments.out;
  if (out.empty()) out = std::filesystem::path(arguments.file).replace_extension(".txtpb").filename();
  std::vector<std::pair<std::filesystem::path, std::string>> files{
      {out, importers::experiment_text(imported, arguments.file.filename().string())}};
  for (const importers::PosesFile& poses : imported.poses)
    files.emplace_back(out.parent_path() / poses.name, poses.text);
  for (const auto& [file, content] : files) {
    if (std::filesystem::exists(file) && !arguments.force)
      throw UserError(fmt::format("{}: exists; give another name with --out, or --force", file.string()));
  }
  for (const auto& [file, content] : files) os::write_file(file, content);
  for (const std::string& note : imported.notes) fmt::print("{}:{}{}\n", name, ending == ".json" ? " " : "", note);
  fmt::print("{}: written{}. Next: kilotwin check {}\n", out.string(),
             imported.poses.empty() ? ""
                                    : fmt::format(", with {} table{} of poses", imported.poses.size(),
                                                  imported.poses.size() == 1 ? "" : "s"),
             out.string());
  return kDone;
}

}  // namespace

Command add_import(CLI::App& program) {
  const auto arguments = std::make_shared<ImportArguments>();
  CLI::App& app = *program.add_subcommand(
      "import", "make an experiment file of an .argos file, of Kilombo's JSON, or of pogosim's YAML");
  app.add_option("FILE", arguments->file, "an .argos file, a .json file of Kilombo, or a .yaml file of pogosim")
      ->required()
      ->check(CLI::ExistingFile.description(""));
  app.add_option("-o,--out", arguments->out, "the experiment file (default: FILE's name with .txtpb, here)")
      ->type_name("FILE");
  app.add_option("--behaviour", arguments->behaviour,
                 "the robots' program in C (default: named after the compiled one)")
      ->type_name("FILE");
  app.add_flag("--force", arguments->force, "replace files that exist");
  app.footer("Example: kilotwin import gather.argos. It prints what has no counterpart, with the line.");
  return {&app, [arguments] { return import_file(*arguments); }};
}

}  // namespace kilotwin::cli
