/// Compiles robots' programs, C or C++ written for kilolib, for the simulation and for the robot's processor.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace kilotwin::behaviours {

struct CompileOptions {
  std::vector<std::string> defines;       ///< macros, NAME or NAME=VALUE
  std::filesystem::path compiler;         ///< empty: the first of cc, gcc, clang on the PATH
  std::filesystem::path cache_directory;  ///< empty: os::cache_directory()
  bool wide_int =
      false;  ///< programs for the simulation keep the host's int of 32 bits; else it has 16, as on the robot
  bool boot_loader = false;  ///< firmware gets this project's boot loader at 0x7000, as a robot has one
  std::string kilolib{};     ///< "kilobot" or "kilogrid"; empty: what the sources show
};

struct CompiledProgram {
  std::filesystem::path file;      ///< a self-contained shared object
  std::string sha256;              ///< SHA-256 of the file, hexadecimal
  std::vector<std::string> notes;  ///< lines for the user: sources left out or added, options that had to be added
  /// The sources of which it was made: the named ones without copies of kilolib, and those that were found.
  std::vector<std::filesystem::path> sources{};
};

/// Compiles C and C++ sources, together with the embedded runtime, into one shared object with fixed compiler flags. Ignores
/// copies of kilolib beside the sources, and searches the neighbourhood for missing sources (program_text.hpp). The cache key is
/// the content of all inputs; equal inputs give equal octets. A single .so is checked and returned unchanged.
/// Throws UserError with the errors, one per line: "FILE:LINE:COLUMN: error: ...". If the machine has no
/// compiler, the error names the package to install.
[[nodiscard]] CompiledProgram compile(const std::vector<std::filesystem::path>& sources,
                                      const CompileOptions& options = {});

/// Compiles and links C sources with avr-gcc and this project's kilolib for the robot's processor. The result is an .elf file in
/// the cache that runs on a robot and on its simulated processor. Searches for missing sources, and keys the cache, as compile()
/// does. Throws UserError like compile().
[[nodiscard]] CompiledProgram compile_firmware(const std::vector<std::filesystem::path>& sources,
                                               const CompileOptions& options = {});

/// Whether these are sources of a station plugin: one of them defines createExpt().
[[nodiscard]] bool is_station_plugin(const std::vector<std::filesystem::path>& sources);

/// Compiles C++ sources of one station plugin (services/ark/plugin/kilotwin_station.hpp) into a shared object, kept in the cache
/// by the content of everything that goes into it. A single .so is returned as it is. Throws UserError as compile() does.
[[nodiscard]] CompiledProgram compile_station_plugin(const std::vector<std::filesystem::path>& sources,
                                                     const CompileOptions& options = {});

/// The program in which plugins run, services/ark/plugin/host.cpp, compiled with the same compiler as they are.
[[nodiscard]] CompiledProgram compile_plugin_host(const CompileOptions& options = {});

/// Memory that a program occupies in an ATmega328P (32 KiB of flash, 2 KiB of RAM), including the functions of the C library that
/// it uses, excluding kilolib.
struct AvrSize {
  std::uint32_t flash_octets = 0;  ///< code, constants, initial values
  std::uint32_t ram_octets = 0;    ///< globals and statics
};

/// Compiles the sources with avr-gcc for the robot's processor and measures their size. `sources` must be all of the program:
/// CompiledProgram::sources. Throws UserError like compile().
[[nodiscard]] AvrSize compile_for_avr(const std::vector<std::filesystem::path>& sources,
                                      const CompileOptions& options = {});

}  // namespace kilotwin::behaviours
