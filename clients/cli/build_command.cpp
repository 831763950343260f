// `kilotwin build`: compiles a behaviour for simulation, or checks that it fits into a robot.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>

#include "clients/cli/commands.hpp"
#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "services/behaviours/compiler.hpp"
#include "services/behaviours/robot_warnings.hpp"

namespace kilotwin::cli {
namespace {

namespace fs = std::filesystem;

struct BuildArguments {
  std::vector<fs::path> sources;
  fs::path out;
  std::vector<std::string> define;
  std::string kilolib;
  bool avr = false, boot_loader = false, wide_int = false;
};

/// Without `out` nothing is written where the user stands: it was a test.
void write_program(const fs::path& compiled, const BuildArguments& arguments) {
  const fs::path& out = arguments.out;
  if (out.empty()) {
    fmt::print("{} builds; -o FILE keeps what was built\n", arguments.sources.front().string());
    return;
  }
  std::error_code error;
  fs::copy_file(compiled, out, fs::copy_options::overwrite_existing, error);
  if (error) throw UserError(fmt::format("{}: cannot be written: {}", out.string(), error.message()));
  fmt::print("{}\n", out.string());
}

/// The notes and warnings about a program; one that is given compiled has none.
void show_remarks(const behaviours::CompiledProgram& program, const behaviours::CompileOptions& options) {
  for (const std::string& note : program.notes) say("note: " + note);
  if (program.sources.empty()) return;
  for (const std::string& warning : behaviours::program_warnings(program.sources, program.sha256, options))
    say(warning);
}

int build_for_robot(const BuildArguments& arguments, const behaviours::CompileOptions& options) {
  const behaviours::CompiledProgram compiled = behaviours::compile_firmware(arguments.sources, options);
  show_remarks(compiled, options);
  if (!arguments.out.empty()) write_program(compiled.file, arguments);
  constexpr double kFlash = 32768, kRam = 2048;
  const behaviours::AvrSize size = behaviours::compile_for_avr(compiled.sources, options);
  fmt::print(
      "ATmega328P: {} octets of flash ({:.1f} % of 32 KiB), {} octets of RAM ({:.1f} % of 2 KiB), without "
      "kilolib and the stack\n",
      size.flash_octets, 100 * size.flash_octets / kFlash, size.ram_octets, 100 * size.ram_octets / kRam);
  return kDone;
}

int build(const BuildArguments& arguments) {
  behaviours::CompileOptions options;
  options.defines = arguments.define;
  options.boot_loader = arguments.boot_loader;
  options.wide_int = arguments.wide_int;
  options.kilolib = arguments.kilolib;
  if (behaviours::is_station_plugin(arguments.sources)) {
    if (arguments.avr) throw UserError("--avr: a plugin of the station runs on no robot; leave --avr out");
    write_program(behaviours::compile_station_plugin(arguments.sources, options).file, arguments);
    return kDone;
  }
  if (arguments.avr) return build_for_robot(arguments, options);
  const behaviours::CompiledProgram compiled = behaviours::compile(arguments.sources, options);
  show_remarks(compiled, options);
  write_program(compiled.file, arguments);
  return kDone;
}

}  // namespace

Command add_build(CLI::App& program) {
  const auto arguments = std::make_shared<BuildArguments>();
  CLI::App& app = *program.add_subcommand(
      "build", "compile a behaviour or a station plugin for simulation, or check a behaviour for the real robot");
  app.add_option("PROGRAM", arguments->sources, "C or C++ sources of one program, or of one plugin of the station")
      ->required()
      ->type_name("");
  app.add_option("-o", arguments->out, "file to write (default: none; the program is only tested)")
      ->type_name("FILE");
  app.add_option("--define", arguments->define, "a macro")->allow_extra_args(false)->type_name("NAME=VALUE");
  app.add_option(
         "--kilolib", arguments->kilolib,
         "the library that the program is written for, kilobot or kilogrid (default: what its sources and headers "
         "show)")
      ->type_name("NAME");
  app.add_flag(
      "--avr", arguments->avr,
      "compile for the ATmega328P and print flash and RAM; with -o, also link firmware (.elf) with a kilolib "
      "that runs on the robot");
  app.add_flag("--wide-int", arguments->wide_int,
               "for simulation: int has 32 bits, as on this machine; else it has 16, as on the robot");
  app.add_flag("--boot-loader", arguments->boot_loader,
               "with --avr and -o: put a boot loader at 0x7000, which takes programs from an overhead controller");
  return {&app, [arguments] { return build(*arguments); }};
}

}  // namespace kilotwin::cli
