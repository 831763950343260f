#include "clients/monitor/alarm.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

namespace kilotwin::monitor {
namespace {

constexpr double kDegrees = 57.29577951308232;
/// Robots that a line lists one by one.
constexpr std::size_t kListed = 8;

struct Words {
  Suspect suspect;
  std::string_view word, name, unit;
};

constexpr std::array<Words, 13> kWords{{
    {Suspect::kGainLeft, "gain_left", "gain of the left wheel", ""},
    {Suspect::kGainRight, "gain_right", "gain of the right wheel", ""},
    {Suspect::kGain, "gain", "gain of both wheels", ""},
    {Suspect::kBiasLeft, "bias_left", "bias of the left wheel", "mm/s"},
    {Suspect::kBiasRight, "bias_right", "bias of the right wheel", "mm/s"},
    {Suspect::kTurnRate, "turn_rate", "turn rate", "rad/s"},
    {Suspect::kDrift, "drift", "drift", "mm/s"},
    {Suspect::kHeading, "heading", "measured heading", "rad"},
    {Suspect::kJump, "jump", "jump of its position", "mm"},
    {Suspect::kCalibrationShift, "calibration_shift", "calibration shift", "mm"},
    {Suspect::kGainOfAll, "gain_all", "gain of both wheels of all robots", ""},
    {Suspect::kDriftOfAll, "drift_all", "drift of all robots", "mm/s"},
    {Suspect::kPatch, "patch", "patch", ""},
}};

const Words& words_of(Suspect suspect) { return kWords[static_cast<std::size_t>(suspect)]; }

std::string text_of(const Size& size, std::string_view unit) {
  if (unit.empty()) return fmt::format("{:+.0f} +- {:.0f} %", 100 * size.value, 100 * size.standard_error);
  return fmt::format("{:+.3g} +- {:.2g} {}", size.value, size.standard_error, unit);
}

std::string sizes_of(const Alarm& alarm) {
  const std::string_view unit = unit_of(alarm.suspect);
  std::vector<std::string> parts;
  for (std::size_t i = 0; i < alarm.sizes.size(); ++i) {
    const Size& size = alarm.sizes[i];
    if (i == 2)
      parts.push_back(
          fmt::format("turn {:+.2g} +- {:.2g} degrees", kDegrees * size.value, kDegrees * size.standard_error));
    else
      parts.push_back((alarm.sizes.size() > 1 ? (i == 0 ? "x " : "y ") : "") + text_of(size, unit));
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

std::string robots_of(const Alarm& alarm) {
  if (alarm.robots.size() == 1) return fmt::format("robot {}", alarm.robots.front());
  const std::size_t listed = std::min(alarm.robots.size(), kListed);
  const std::vector<std::uint32_t> first(alarm.robots.begin(),
                                         alarm.robots.begin() + static_cast<std::ptrdiff_t>(listed));
  return fmt::format("robots {}{}", fmt::join(first, ", "),
                     listed < alarm.robots.size() ? fmt::format(" and {} more", alarm.robots.size() - listed) : "");
}

std::string who(const Alarm& alarm) {
  switch (alarm.suspect) {
    case Suspect::kCalibrationShift:
      return alarm.tracker.empty() ? "the tracker leaves the model"
                                   : fmt::format("tracker \"{}\" leaves the model", alarm.tracker);
    case Suspect::kGainOfAll:
    case Suspect::kDriftOfAll:
    case Suspect::kPatch: return "the arena leaves the model";
    default: return robots_of(alarm) + " leaves the model";
  }
}

std::string what(const Alarm& alarm) {
  if (alarm.suspect != Suspect::kPatch) return std::string(name_of(alarm.suspect));
  const bool is_slow = !alarm.sizes.empty() && alarm.sizes.front().value < 0;
  return fmt::format("{} patch, gain of both wheels", is_slow ? "slow" : "fast");
}

std::vector<std::string_view> words_of(const std::vector<Suspect>& suspects) {
  std::vector<std::string_view> words;
  for (const Suspect suspect : suspects) words.push_back(word_of(suspect));
  return words;
}

}  // namespace

std::string_view word_of(Suspect suspect) { return words_of(suspect).word; }
std::string_view name_of(Suspect suspect) { return words_of(suspect).name; }
std::string_view unit_of(Suspect suspect) { return words_of(suspect).unit; }

std::string line_of(const Alarm& alarm) {
  std::string line =
      fmt::format("monitor: {:.1f} s: {}: {} {} since {:.1f} s, at ({:.0f}, {:.0f}) mm", alarm.time_s, who(alarm),
                  what(alarm), sizes_of(alarm), alarm.onset_s, alarm.x_mm, alarm.y_mm);
  if (alarm.suspect == Suspect::kPatch) line += fmt::format(", by {}", robots_of(alarm));
  if (!alarm.alternatives.empty()) {
    std::vector<std::string_view> names;
    for (const Suspect suspect : alarm.alternatives) names.push_back(name_of(suspect));
    line += fmt::format("; or {}", fmt::join(names, ", or "));
  }
  return line + fmt::format("; evidence {:.0f} nat", alarm.evidence_nat);
}

std::string table_header() {
  return "time_s,onset_s,suspect,alternatives,robots,tracker,x_mm,y_mm,unit,size,size_se,size_y,size_y_se,turn_rad,"
         "turn_rad_se,evidence_nat,threshold_nat";
}

std::string table_row(const Alarm& alarm) {
  std::string tracker;
  for (const char c : alarm.tracker) tracker += c == '"' ? std::string("\"\"") : std::string(1, c);
  std::string row =
      fmt::format("{:.3f},{:.3f},{},{},{},\"{}\",{:.1f},{:.1f},{}", alarm.time_s, alarm.onset_s,
                  word_of(alarm.suspect), fmt::join(words_of(alarm.alternatives), " "),
                  fmt::join(alarm.robots, " "), tracker, alarm.x_mm, alarm.y_mm, unit_of(alarm.suspect));
  for (std::size_t i = 0; i < 3; ++i) {
    row += i < alarm.sizes.size()
               ? fmt::format(",{:.5g},{:.3g}", alarm.sizes[i].value, alarm.sizes[i].standard_error)
               : ",,";
  }
  return row + fmt::format(",{:.2f},{:.2f}", alarm.evidence_nat, alarm.threshold_nat);
}

}  // namespace kilotwin::monitor
