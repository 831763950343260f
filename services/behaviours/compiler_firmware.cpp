// Compiles programs for the robot's processor: avr-gcc, linked with this project's kilolib for the AVR.
#include <cstdlib>
#include <system_error>

#include "core/base/error.hpp"
#include "core/os/files.hpp"
#include "core/os/process.hpp"
#include "services/behaviours/compiler.hpp"
#include "services/behaviours/compiler_common.hpp"
#include "services/behaviours/sha256.hpp"

namespace kilotwin::behaviours {
namespace fs = std::filesystem;

namespace {

std::vector<std::string> common_arguments(const fs::path& gcc, const fs::path& runtime) {
  return {gcc.string(),
          "-mmcu=atmega328p",
          "-Os",
          "-g",
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
                   first_error(compiled.errors, {runtime / "avr/boot_loader.c"}));
  const os::ProcessResult copied = run_compiler(
      {(gcc.parent_path() / "avr-objcopy").string(), "-O", "binary", linked.string(), octets.string()});
  if (!copied.end.well()) throw RunError("avr-objcopy: " + copied.errors);
  return octets;
}

}  // namespace

CompiledProgram compile_firmware(const std::vector<fs::path>& sources, const CompileOptions& options) {
  const fs::path gcc = os::find_executable("avr-gcc");
  if (gcc.empty()) throw UserError("no avr-gcc on this machine; apt-get install gcc-avr avr-libc binutils-avr");
  const fs::path cache = os::cache_directory(options.cache_directory), runtime = unpacked_runtime(cache);
  std::error_code error;
  fs::create_directories(cache / "firmware", error);
  std::string unfinished = (cache / "firmware" / "linking-XXXXXX").string();
  if (mkdtemp(unfinished.data()) == nullptr) throw RunError(unfinished + ": cannot be made; is the disk full?");

  const fs::path whole = fs::path(unfinished) / "program.elf";
  std::vector<std::string> arguments = common_arguments(gcc, runtime);
  for (const std::string& flag : define_flags(options.defines)) arguments.push_back(flag);
  // Equal sources in different folders give equal octets.
  if (const fs::path here = fs::current_path(error); !error)
    arguments.push_back("-fdebug-prefix-map=" + here.string() + "=.");
  for (const fs::path& source : sources) {
    if (source.has_parent_path()) arguments.push_back("-fdebug-prefix-map=" + source.parent_path().string() + "=.");
  }
  arguments.push_back("-fdebug-prefix-map=" + runtime.string() + "=/kilotwin");
  for (const fs::path& source : sources) arguments.push_back(source.string());
  arguments.insert(arguments.end(), {(runtime / "avr/kilolib.c").string(), (runtime / "avr/infrared.S").string(),
                                     "-lm", "-o", whole.string()});
  if (options.boot_loader) {
    const fs::path loader = compile_boot_loader(gcc, runtime, unfinished);
    arguments.insert(arguments.end(),
                     {"-Wl,--section-start=.boot_loader=0x7000", "-Wl,-u,kilo_boot_loader",
                      "-DBOOT_LOADER=\"" + loader.string() + "\"", (runtime / "avr/boot_section.S").string()});
  }
  const os::ProcessResult result = run_compiler(arguments);
  const auto octets = os::read_if_there(whole);
  fs::remove_all(unfinished, error);
  if (options.boot_loader && result.errors.find("overlaps") != std::string::npos) {
    throw UserError(sources.front().string() +
                    ": the program reaches into the boot loader's section of the flash; it has room for 28 KiB");
  }
  if (!result.end.well() || !octets) throw UserError(first_error(result.errors, sources));
  const std::string sha256 = sha256_hex(*octets);
  const fs::path file = cache / "firmware" / (sha256 + ".elf");
  os::write_file(file, *octets);
  return {file, sha256, {}};
}

}  // namespace kilotwin::behaviours
