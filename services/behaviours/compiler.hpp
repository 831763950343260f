/// Turns robots' programs, C or C++ written for kilolib, into what this simulation runs, and checks them for the real robot.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace kilotwin::behaviours {

struct CompileOptions {
  std::vector<std::string> defines;       ///< macros, NAME or NAME=VALUE
  std::filesystem::path compiler;         ///< empty: the first of cc, gcc, clang on the PATH
  std::filesystem::path cache_directory;  ///< empty: as files.hpp says
};

struct CompiledProgram {
  std::filesystem::path file;      ///< a self-contained shared object
  std::string sha256;              ///< of its octets
  std::vector<std::string> notes;  ///< what a user should know of how it was compiled, one line each
};

/// Compiles C and C++ sources, together with the embedded runtime, into one shared object with pinned flags. Copies of
/// kilolib next to them are left aside, and sources that they lack are looked for around them (program_text.hpp). The result is kept in
/// the cache by the content of everything that goes into it; the same content gives the same octets. A single .so is
/// checked and returned as it is.
/// Throws UserError: "FILE:LINE:COLUMN: error: ..." of the first error, and how many more there are; or, where the machine
/// has no compiler, the package to install.
[[nodiscard]] CompiledProgram compile(const std::vector<std::filesystem::path>& sources,
                                      const CompileOptions& options = {});

/// Compiles and links C sources with avr-gcc and this project's own kilolib for the robot's processor: an .elf file, kept in
/// the cache, for a robot or its simulated processor. Throws UserError as compile() does.
[[nodiscard]] CompiledProgram compile_firmware(const std::vector<std::filesystem::path>& sources,
                                               const CompileOptions& options = {});

/// What a program needs of an ATmega328P (32 KiB of flash, 2 KiB of RAM), with what it uses of the C library and without
/// kilolib.
struct AvrSize {
  std::uint32_t flash_octets = 0;  ///< code, constants, initial values
  std::uint32_t ram_octets = 0;    ///< globals and statics
};

/// Compiles the sources with avr-gcc for the real robot. Throws UserError as compile() does.
[[nodiscard]] AvrSize compile_for_avr(const std::vector<std::filesystem::path>& sources,
                                      const CompileOptions& options = {});

}  // namespace kilotwin::behaviours
