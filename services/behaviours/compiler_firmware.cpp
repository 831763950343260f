// Compiles programs for the robot's processor: avr-gcc, linked with this project's kilolib for the AVR.
#include <cstdlib>
#include <system_error>

#include "core/base/error.hpp"
#include "core/os/files.hpp"
#include "core/os/process.hpp"
#include "core/os/temporary_folder.hpp"
#include "services/behaviours/compiler.hpp"
#include "services/behaviours/compiler_common.hpp"
#include "services/behaviours/program_text.hpp"
#include "services/behaviours/sha256.hpp"

namespace kilotwin::behaviours {
namespace fs = std::filesystem;

namespace {

std::vector<std::string> common_arguments(const fs::path& gcc, const fs::path& runtime) {
  return {gcc.string(),
          "-mmcu=atmega328p",
          "-Os",
          "-gdwarf-4",  // by default this compiler writes stabs, which libdw does not read
          "-std=gnu11",
          "-DF_CPU=8000000",
          "-funsigned-char",
          "-funsigned-bitfields",
          "-fpack-struct",
          "-fshort-enums",
          "-ffunction-sections",
          "-fdata-sections",
          "-fcommon",
          "-Wl,--gc-sections",
          "-fdiagnostics-color=never",
          "-isystem",
          (runtime / "kilolib").string()};
}

/// Writes the boot loader's octets, which begin at 0x7000 of the flash, as `boot_loader.bin` in `folder`.
fs::path compile_boot_loader(const fs::path& gcc, const fs::path& runtime, const fs::path& folder) {
  const fs::path linked = folder / "boot_loader.elf", octets = folder / "boot_loader.bin";
  std::vector<std::string> arguments = common_arguments(gcc, runtime);
  arguments.insert(arguments.end(), {"-DKILO_BOOT_LOADER", "-Wl,--section-start=.text=0x7000",
                                     (runtime / "avr/boot_loader.c").string(), (runtime / "avr/kilolib.c").string(),
                                     (runtime / "avr/infrared.S").string(), "-o", linked.string()});
  const os::ProcessResult compiled = run_compiler(arguments);
  if (!compiled.end.well())
    throw RunError("the boot loader does not compile: " +
                   all_errors(compiled.errors, {runtime / "avr/boot_loader.c"}));
  const os::ProcessResult copied = run_compiler(
      {(gcc.parent_path() / "avr-objcopy").string(), "-O", "binary", linked.string(), octets.string()});
  if (!copied.end.well()) throw RunError("avr-objcopy: " + copied.errors);
  return octets;
}

/// The arguments that link kilolib, and the boot loader if asked, into the program.
std::vector<std::string> link_arguments(const fs::path& gcc, const fs::path& runtime, const fs::path& folder,
                                        bool boot_loader) {
  std::vector<std::string> arguments{(runtime / "avr/kilolib.c").string(), (runtime / "avr/infrared.S").string(),
                                     "-lm"};
  if (!boot_loader) return arguments;
  const fs::path loader = compile_boot_loader(gcc, runtime, folder);
  arguments.insert(arguments.end(),
                   {"-Wl,--section-start=.boot_loader=0x7000", "-Wl,-u,kilo_boot_loader",
                    "-DBOOT_LOADER=\"" + loader.string() + "\"", (runtime / "avr/boot_section.S").string()});
  return arguments;
}

}  // namespace

CompiledProgram compile_firmware(const std::vector<fs::path>& given, const CompileOptions& options) {
  check_sources(given);
  const fs::path gcc = os::find_executable("avr-gcc");
  if (gcc.empty()) throw UserError("no avr-gcc on this machine; apt-get install gcc-avr avr-libc binutils-avr");
  const fs::path cache = os::cache_directory(options.cache_directory), runtime = unpacked_runtime(cache);
  const os::TemporaryFolder folder("linking", cache / "firmware");
  const fs::path whole = folder.path() / "program.elf";
  std::vector<std::string> common = common_arguments(gcc, runtime);
  for (const std::string& flag : define_flags(options.defines)) common.push_back(flag);
  // Equal sources in different folders give equal octets.
  std::error_code error;
  if (const fs::path here = fs::current_path(error); !error)
    common.push_back("-fdebug-prefix-map=" + here.string() + "=.");
  for (const fs::path& source : given) {
    if (source.has_parent_path()) common.push_back("-fdebug-prefix-map=" + source.parent_path().string() + "=.");
  }
  common.push_back("-fdebug-prefix-map=" + runtime.string() + "=/kilotwin");
  const std::vector<std::string> rest = link_arguments(gcc, runtime, folder.path(), options.boot_loader);
  const auto preprocessed = [&](const fs::path& source) {
    std::vector<std::string> arguments = common;
    arguments.insert(arguments.end(), {"-E", "-P", program_text({source}, cache).files[0].string()});
    const os::ProcessResult result = run_compiler(arguments);
    return result.end.well() ? result.output : "";
  };
  std::vector<fs::path> sources = given;
  std::vector<std::string> notes;
  for (;;) {
    const ProgramText text = program_text(sources, cache);
    std::vector<std::string> arguments = common;
    for (const fs::path& file : text.files) arguments.push_back(file.string());
    arguments.insert(arguments.end(), rest.begin(), rest.end());
    arguments.insert(arguments.end(), {"-o", whole.string()});
    const os::ProcessResult result = run_compiler(arguments);
    if (options.boot_loader && result.errors.find("overlaps") != std::string::npos) {
      throw UserError(given.front().string() +
                      ": the program reaches into the boot loader's section of the flash; it has room for 28 KiB");
    }
    if (const auto octets = os::read_if_there(whole); result.end.well() && octets) {
      const std::string sha256 = sha256_hex(*octets);
      const fs::path file = cache / "firmware" / (sha256 + ".elf");
      os::write_file(file, *octets);
      notes.insert(notes.begin(), text.notes.begin(), text.notes.end());
      return {file, sha256, notes};
    }
    const std::vector<fs::path> more = sources_with(undefined_names(result.errors), text, preprocessed);
    if (more.empty()) throw UserError(all_errors(result.errors, text.sources));
    for (const fs::path& source : more) {
      notes.push_back(source.string() + ": compiled too; it has what the program lacks");
      sources.push_back(source);
    }
  }
}

}  // namespace kilotwin::behaviours
