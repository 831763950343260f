/// Firmware for tests: C programs, compiled with the project's own kilolib for the robot.
#pragma once

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "core/os/files.hpp"
#include "services/behaviours/compiler.hpp"
#include "services/comm/firmware/flash_image.hpp"

namespace kilotwin::firmware {

/// A complete program around the given part.
inline std::string whole_program(const std::string& functions, const std::string& callbacks = {}) {
  return "#include <kilolib.h>\n#include <avr/io.h>\n" + functions + "\nint main(void) { kilo_init(); " +
         callbacks + " kilo_start(setup, loop); return 0; }\n";
}

inline std::filesystem::path compiled(const std::string& source, bool boot_loader = false) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("kilotwin-firmware-test-" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  const std::filesystem::path file = folder / "program.c";
  std::ofstream(file) << source;
  behaviours::CompileOptions options;
  options.boot_loader = boot_loader;
  return behaviours::compile_firmware({file}, options).file;
}

inline FlashImage firmware(const std::string& source) {
  const std::filesystem::path file = compiled(source);
  return parse_firmware(os::read_if_there(file).value(), file.string());
}

}  // namespace kilotwin::firmware
