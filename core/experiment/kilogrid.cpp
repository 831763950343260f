#include "core/experiment/kilogrid.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>

#include "core/base/eeprom_layout.h"
#include "core/base/kilogrid_cell.h"
#include "core/experiment/text_file.hpp"

namespace kilotwin {
namespace {

constexpr std::uint32_t kMostModules = 256;  ///< along each axis: an octet holds a module's column and row
constexpr int kHexadecimal = 16;

struct ModuleAddress {
  std::uint32_t x = 0, y = 0;  ///< column and row, from the bottom left
  auto operator<=>(const ModuleAddress&) const = default;
};

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r";
  const std::size_t begin = text.find_first_not_of(kBlank);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlank) - begin + 1);
}

std::optional<std::uint32_t> number_in(std::string_view text, int base) {
  text = trimmed(text);
  if (base == kHexadecimal && (text.starts_with("0x") || text.starts_with("0X"))) text.remove_prefix(2);
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Reads a .kconf file: sections `address` with lines `module:X-Y,...`, `x:A-B` (columns) or `y:A-B` (rows), each followed by a
/// section `data` with one hexadecimal octet per line. A later section replaces the octets of an earlier one. A comment goes from `#` to
/// the end of its line.
class ConfigurationFile {
 public:
  ConfigurationFile(std::string file, ModuleAddress size) : file_(std::move(file)), size_(size) {}

  std::map<ModuleAddress, std::string> read(const std::string& text) {
    std::istringstream lines(text);
    for (std::string raw; std::getline(lines, raw);) {
      ++line_;
      const std::string_view line = trimmed(std::string_view(raw).substr(0, raw.find('#')));
      if (line.empty()) continue;
      if (line.starts_with("address")) {
        if (in_data_) addressed_.clear();
        in_data_ = false;
      } else if (line.starts_with("data")) {
        if (addressed_.empty()) fail("data without an address; write `address` and `module:X-Y` before it");
        for (const ModuleAddress& module : addressed_) octets_[module].clear();
        in_data_ = true;
      } else if (in_data_) {
        take_octet(line);
      } else {
        take_address(line);
      }
    }
    return std::move(octets_);
  }

 private:
  [[noreturn]] void fail(std::string_view what) const {
    throw UserError(fmt::format("{}:{}:1: {}", file_, line_, what));
  }

  void take_octet(std::string_view line) {
    const auto octet = number_in(line, kHexadecimal);
    if (!octet || *octet > 0xff)
      fail(fmt::format("{} is no octet; it takes hexadecimal numbers 0x00 to 0xff", line));
    for (const ModuleAddress& module : addressed_) {
      if (octets_[module].size() == KILOTWIN_CELL_MOST_OCTETS)
        fail(fmt::format("a module's configuration takes at most {} octets; remove lines",
                         int{KILOTWIN_CELL_MOST_OCTETS}));
      octets_[module] += static_cast<char>(*octet);
    }
  }

  void take_address(std::string_view line) {
    const std::size_t colon = line.find(':');
    const std::string_view kind = trimmed(line.substr(0, colon));
    if (colon == std::string_view::npos || (kind != "module" && kind != "x" && kind != "y"))
      fail(fmt::format("{} is no address; it takes module:X-Y, x:A-B or y:A-B", line));
    for (std::string_view rest = line.substr(colon + 1);;) {
      const std::size_t comma = rest.find(',');
      const std::string_view item = rest.substr(0, comma);
      const std::size_t dash = item.find('-');
      const auto from = number_in(item.substr(0, dash), 10);
      const auto to = dash == std::string_view::npos ? from : number_in(item.substr(dash + 1), 10);
      if (!from || !to || (kind == "module" && dash == std::string_view::npos) || (kind != "module" && *from > *to))
        fail(fmt::format("{} is no address; it takes module:X-Y, x:A-B or y:A-B", line));
      if (kind == "module")
        add({*from, *to});
      else
        for (std::uint32_t i = *from; i <= *to; ++i) add_line(kind == "x", i);
      if (comma == std::string_view::npos) return;
      rest.remove_prefix(comma + 1);
    }
  }

  /// A column or a row of modules.
  void add_line(bool column, std::uint32_t at) {
    const std::uint32_t modules = column ? size_.y : size_.x;
    for (std::uint32_t i = 0; i < modules; ++i) add(column ? ModuleAddress{at, i} : ModuleAddress{i, at});
  }

  void add(ModuleAddress module) {
    if (module.x >= size_.x || module.y >= size_.y) {
      fail(fmt::format("there is no module {}-{}; the group's modules are 0-0 to {}-{}", module.x, module.y,
                       size_.x - 1, size_.y - 1));
    }
    addressed_.insert(module);
  }

  std::string file_;
  ModuleAddress size_;
  int line_ = 0;
  bool in_data_ = false;
  std::set<ModuleAddress> addressed_;
  std::map<ModuleAddress, std::string> octets_;
};

/// The cells' EEPROM before their own octets: nothing of a robot's calibration.
std::string blank_eeprom(std::uint16_t uid) {
  std::array<std::uint8_t, KILOTWIN_EEPROM_OCTETS> octets;
  kilotwin_fill_eeprom(octets.data(), {uid, 0, 0, 0, 0});
  return {octets.begin(), octets.end()};
}

}  // namespace

void check_cells(const LoadedExperiment& loaded) {
  const proto::Experiment& experiment = loaded.experiment;
  for (int g = 0; g < experiment.robots_size(); ++g) {
    const proto::RobotGroup& group = experiment.robots(g);
    if (!group.has_cells()) continue;
    const std::string path = fmt::format("robots[{}]", g);
    const auto refuse = [&](const std::string& field, const std::string& what) {
      throw loaded.locations.error(field, what);
    };
    if (group.body() == proto::RobotGroup::TRACKED)
      refuse(path + ".body", "cells are simulated; remove body: TRACKED");
    if (group.has_eeprom()) refuse(path + ".eeprom", "cells have their configuration in the EEPROM; remove eeprom");
    const proto::GridLayout& grid = group.layout().grid();
    if (!group.layout().has_grid() || grid.columns() == 0 || grid.columns() % 2 != 0 ||
        group.count() % (2 * grid.columns()) != 0) {
      refuse(group.has_layout() ? path + ".layout" : path + ".cells",
             "cells lie in a full grid of an even number of columns and rows; state layout { grid { columns: C "
             "pitch_mm: 50 } } and count: C times the number of rows");
    }
    if (grid.columns() / 2 > kMostModules || group.count() / grid.columns() / 2 > kMostModules) {
      refuse(path + ".count", fmt::format("there are more than {} modules along one side; a Kilogrid takes at most "
                                          "that many",
                                          kMostModules));
    }
    if (experiment.radio().model() != proto::Radio::DISC)
      refuse("radio.model", "cells need the radio's model DISC; choose it, or remove the cells");
    if (const double least_mm = grid.pitch_mm() / std::sqrt(2.0); experiment.radio().range_mm() < least_mm) {
      refuse("radio.range_mm",
             fmt::format("the radio does not reach a cell's corner; it takes at least {} mm", std::ceil(least_mm)));
    }
    if (experiment.light().shadows()) refuse("light.shadows", "cells would cast shadows; remove one of the two");
    if (experiment.station().environment_size() > 0)
      refuse("station.environment",
             "the station would take cells for robots; remove the environments or the cells");
  }
}

std::vector<proto::RobotEeprom> cell_eeproms(const LoadedExperiment& loaded, int g, std::uint32_t first,
                                             std::uint32_t count) {
  const proto::RobotGroup& group = loaded.experiment.robots(g);
  const std::uint32_t columns = group.layout().grid().columns(), rows = count / columns;
  std::map<ModuleAddress, std::string> configurations;
  if (group.cells().has_configuration()) {
    const std::string file = loaded.resolve(group.cells().configuration()).string();
    const std::string where = loaded.locations.where(fmt::format("robots[{}].cells.configuration", g));
    configurations = ConfigurationFile(file, {columns / 2, rows / 2}).read(read_text(file, where));
  }
  std::vector<proto::RobotEeprom> eeproms;
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t column = i % columns, up = rows - 1 - i / columns;
    const std::string& octets = configurations[{column / 2, up / 2}];
    std::string content = blank_eeprom(static_cast<std::uint16_t>(first + i));
    content[KILOTWIN_CELL_MODULE_X] = static_cast<char>(column / 2);
    content[KILOTWIN_CELL_MODULE_Y] = static_cast<char>(up / 2);
    content[KILOTWIN_CELL_NUMBER] = static_cast<char>(2 * (1 - up % 2) + column % 2);
    content[KILOTWIN_CELL_OCTETS] = static_cast<char>(octets.size());
    content.replace(KILOTWIN_CELL_CONFIGURATION, octets.size(), octets);
    proto::RobotEeprom& eeprom = eeproms.emplace_back();
    eeprom.set_robot(first + i);
    eeprom.set_content(std::move(content));
  }
  return eeproms;
}

}  // namespace kilotwin
