#include <sstream>

#include "core/base/error.hpp"
#include "core/os/files.hpp"
#include "core/os/process.hpp"
#include "core/os/temporary_folder.hpp"
#include "services/behaviours/compiler.hpp"
#include "services/behaviours/compiler_common.hpp"
#include "services/behaviours/program_text.hpp"

namespace kilotwin::behaviours {
namespace fs = std::filesystem;
namespace {

std::string required_tool(const char* name, const char* package) {
  const fs::path path = os::find_executable(name);
  if (path.empty()) throw UserError(std::string("no ") + name + " on this machine; apt-get install " + package);
  return path.string();
}

/// Parses the output of avr-size: text, data and bss in the second line.
AvrSize parsed_size(const std::string& table) {
  std::istringstream stream(table);
  std::string header;
  std::getline(stream, header);
  std::uint32_t text = 0, data = 0, bss = 0;
  if (!(stream >> text >> data >> bss)) throw RunError("avr-size printed no sizes: " + table);
  return {text + data, data + bss};
}

}  // namespace

AvrSize compile_for_avr(const std::vector<fs::path>& sources, const CompileOptions& options) {
  check_sources(sources);
  const std::string gcc = required_tool("avr-gcc", "gcc-avr avr-libc");
  const std::string size = required_tool("avr-size", "binutils-avr");
  const fs::path runtime = unpacked_runtime(os::cache_directory(options.cache_directory));
  const os::TemporaryFolder folder("kilotwin-avr");
  const Kilolib kilolib = kilolib_for(sources, options);
  std::vector<std::string> link{gcc, "-mmcu=atmega328p", "-r", "-nostartfiles", "-Wl,-d"};
  const ProgramText text = program_text(sources, os::cache_directory(options.cache_directory), kilolib);
  for (const fs::path& source : text.files) {
    const std::string object = (folder.path() / (std::to_string(link.size()) + ".o")).string();
    std::vector<std::string> arguments{gcc,
                                       "-mmcu=atmega328p",
                                       "-Os",
                                       is_cpp(source) ? "-std=gnu++11" : "-std=gnu11",
                                       "-DF_CPU=8000000",
                                       "-funsigned-char",
                                       "-funsigned-bitfields",
                                       "-fpack-struct",
                                       "-fshort-enums",
                                       "-fdiagnostics-color=never"};
    for (const std::string& flag : kilolib_flags(kilolib, runtime)) arguments.push_back(flag);
    arguments.insert(arguments.end(), {"-isystem", (runtime / "kilolib").string()});
    for (const std::string& flag : define_flags(options.defines)) arguments.push_back(flag);
    arguments.insert(arguments.end(), {"-c", source.string(), "-o", object});
    const os::ProcessResult result = run_compiler(arguments);
    if (!result.end.well()) throw UserError(all_errors(result.errors, text.sources));
    link.push_back(object);
  }
  // A relocatable link of all objects with the C library. References to kilolib stay undefined.
  const std::string whole = (folder.path() / "program.o").string();
  link.insert(link.end(), {"-Wl,--start-group", "-lm", "-lc", "-lgcc", "-Wl,--end-group", "-o", whole});
  const os::ProcessResult linked = run_compiler(link);
  if (!linked.end.well()) throw UserError(all_errors(linked.errors, sources));
  return parsed_size(run_compiler({size, whole}).output);
}

}  // namespace kilotwin::behaviours
