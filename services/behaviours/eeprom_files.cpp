#include "services/behaviours/eeprom_files.hpp"

#include "core/os/files.hpp"

namespace kilotwin::behaviours {

void write_eeproms(const BehavioursEngine& engine, Share share, const std::filesystem::path& run_directory) {
  const std::filesystem::path directory = run_directory / "eeprom";
  for (std::uint32_t robot = share.first; robot < share.last; ++robot) {
    const BehavioursEngine::Eeprom* const eeprom = engine.eeprom(robot);
    if (eeprom == nullptr) continue;
    std::error_code ignored;
    std::filesystem::create_directories(directory, ignored);
    os::write_file(directory / (std::to_string(robot) + ".eeprom"),
                   {reinterpret_cast<const char*>(eeprom->data()), eeprom->size()});  // NOLINT
  }
}

}  // namespace kilotwin::behaviours
