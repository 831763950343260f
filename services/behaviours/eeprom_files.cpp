#include "services/behaviours/eeprom_files.hpp"

#include "core/os/files.hpp"
#include "core/base/error.hpp"

namespace kilotwin::behaviours {

void write_eeproms(const BehavioursEngine& engine, Share share, const std::filesystem::path& run_directory) {
  const std::filesystem::path directory = run_directory / "eeprom";
  for (std::uint32_t robot = share.first; robot < share.last; ++robot) {
    const BehavioursEngine::Eeprom* const eeprom = engine.eeprom(robot);
    if (eeprom == nullptr) continue;
    std::error_code ignored;
    std::filesystem::create_directories(directory, ignored);
    const std::filesystem::path file = directory / (std::to_string(robot) + ".eeprom");
    if (!write_file(file, {reinterpret_cast<const char*>(eeprom->data()), eeprom->size()}))  // NOLINT
      throw RunError(file.string() + ": cannot be written");
  }
}

}  // namespace kilotwin::behaviours
