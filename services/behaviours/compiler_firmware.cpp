// Compiles programs for the robot's processor: avr-gcc, linked with this project's kilolib for the AVR.
#include <algorithm>
#include <optional>
#include <system_error>
#include <utility>

#include "core/base/error.hpp"
#include "core/os/files.hpp"
#include "core/os/process.hpp"
#include "core/os/temporary_folder.hpp"
#include "services/behaviours/companions.hpp"
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

/// avr-gcc with the flags and the runtime, which do not depend on the program.
struct AvrToolchain {
  fs::path gcc, cache, runtime;
  Kilolib kilolib;
  std::vector<std::string> flags;
  std::string content;  ///< whatever else the result depends on: for the keys of the cache

  AvrToolchain(const std::vector<fs::path>& sources, const CompileOptions& options)
      : gcc(os::find_executable("avr-gcc")),
        cache(os::cache_directory(options.cache_directory)),
        kilolib(kilolib_for(sources, options)) {
    if (gcc.empty()) throw UserError("no avr-gcc on this machine; apt-get install gcc-avr avr-libc binutils-avr");
    runtime = unpacked_runtime(cache);
    if (kilolib == Kilolib::kKilogridModule)
      throw UserError(sources.front().string() +
                      ": a module's program for the Kilogrid runs natively only; leave avr out");
    flags = common_arguments(gcc, runtime);
    const std::vector<std::string> library = kilolib_flags(kilolib, runtime);
    flags.insert(std::find(flags.begin(), flags.end(), "-isystem"), library.begin(), library.end());
    content = run_compiler({gcc.string(), "--version"}).output;
    for (const std::string& flag : flags) content += flag + '\n';
    const std::vector<std::string> defines = define_flags(options.defines);
    flags.insert(flags.end(), defines.begin(), defines.end());
  }

  /// The boot loader's octets, which begin at 0x7000 of the flash; kept in the cache.
  [[nodiscard]] fs::path boot_loader() const;
  /// Links kilolib into the program, and the boot loader if `boot_loader`; or returns the cached result.
  [[nodiscard]] CompiledProgram make(const ProgramText& text, bool boot_loader) const;
  [[nodiscard]] std::optional<std::string> preprocessed(const fs::path& file, bool with_lines) const;

 private:
  [[nodiscard]] std::string link(const ProgramText& text, bool boot_loader) const;
};

fs::path AvrToolchain::boot_loader() const {
  fs::path kept = cache / "firmware" / ("boot-loader-" + sha256_hex(content).substr(0, 32) + ".bin");
  std::error_code error;
  if (fs::is_regular_file(kept, error)) return kept;
  const os::TemporaryFolder folder("boot-loader", cache / "firmware");
  const fs::path linked = folder.path() / "boot_loader.elf", octets = folder.path() / "boot_loader.bin";
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
  os::write_file(kept, os::read_file(octets));
  return kept;
}

/// Preprocessed text; `with_lines`: with the lines that name files and numbers, which debug information holds.
std::optional<std::string> AvrToolchain::preprocessed(const fs::path& file, bool with_lines) const {
  std::vector<std::string> arguments = flags;
  arguments.insert(arguments.end(), {"-E", file.string()});
  if (!with_lines) arguments.emplace_back("-P");
  os::ProcessResult result = run_compiler(arguments);
  if (!result.end.well()) return std::nullopt;
  return std::move(result.output);
}

/// The octets of the linked program.
std::string AvrToolchain::link(const ProgramText& text, bool boot_loader) const {
  const os::TemporaryFolder folder("linking", cache / "firmware");
  const fs::path whole = folder.path() / "program.elf";
  std::vector<std::string> arguments = flags;
  // Equal sources in different folders give equal octets.
  std::error_code error;
  if (const fs::path here = fs::current_path(error); !error)
    arguments.push_back("-fdebug-prefix-map=" + here.string() + "=.");
  for (const fs::path& source : text.sources) {
    if (source.has_parent_path()) arguments.push_back("-fdebug-prefix-map=" + source.parent_path().string() + "=.");
  }
  arguments.push_back("-fdebug-prefix-map=" + runtime.string() + "=/kilotwin");
  for (const fs::path& file : text.files) arguments.push_back(file.string());
  if (const fs::path library = kilolib_source(kilolib, runtime); !library.empty())
    arguments.push_back(library.string());
  arguments.insert(arguments.end(),
                   {(runtime / "avr/kilolib.c").string(), (runtime / "avr/infrared.S").string(), "-lm"});
  if (boot_loader)
    arguments.insert(arguments.end(), {"-Wl,--section-start=.boot_loader=0x7000", "-Wl,-u,kilo_boot_loader",
                                       "-DBOOT_LOADER=\"" + this->boot_loader().string() + "\"",
                                       (runtime / "avr/boot_section.S").string()});
  arguments.insert(arguments.end(), {"-o", whole.string()});
  const os::ProcessResult result = run_compiler(arguments);
  if (boot_loader && result.errors.find("overlaps") != std::string::npos) {
    throw UserError(text.sources.front().string() +
                    ": the program reaches into the boot loader's section of the flash; it has room for 28 KiB");
  }
  if (result.end.well()) return os::read_file(whole);
  if (!undefined_names(result.errors).empty()) throw Incomplete{result.errors};
  throw UserError(all_errors(result.errors, text.sources));
}

CompiledProgram AvrToolchain::make(const ProgramText& text, bool boot_loader) const {
  std::string key = content + runtime.filename().string() + (boot_loader ? "\nboot loader\n" : "\n");
  for (const fs::path& file : text.files) key += sha256_hex(preprocessed(file, true).value_or(""));
  // The file is named by its own hash; the key leads to that name.
  const fs::path folder = cache / "firmware", entry = folder / ("by-input-" + sha256_hex(key));
  if (const auto name = os::read_if_there(entry)) {
    const fs::path kept = folder / (*name + ".elf");
    if (const auto octets = os::read_if_there(kept); octets && sha256_hex(*octets) == *name)
      return {kept, *name, {}};
  }
  const std::string octets = link(text, boot_loader), sha256 = sha256_hex(octets);
  const fs::path file = folder / (sha256 + ".elf");
  os::write_file(file, octets);
  os::write_file(entry, sha256);
  return {file, sha256, {}};
}

}  // namespace

CompiledProgram compile_firmware(const std::vector<fs::path>& sources, const CompileOptions& options) {
  check_sources(sources);
  const AvrToolchain toolchain(sources, options);
  std::string kind = "robot";
  for (const std::string& define : options.defines) kind += '\n' + define;
  return with_companions(
      sources, toolchain.cache,
      {toolchain.kilolib, kind, [&](const ProgramText& text) { return toolchain.make(text, options.boot_loader); },
       [&](const fs::path& source) {
         const ProgramText text = program_text({source}, toolchain.cache, toolchain.kilolib);
         return toolchain.preprocessed(text.files[0], false).value_or("");
       }});
}

}  // namespace kilotwin::behaviours
