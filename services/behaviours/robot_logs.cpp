#include "services/behaviours/robot_logs.hpp"

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <system_error>

#include "core/os/files.hpp"
#include "core/base/error.hpp"

namespace kilotwin::behaviours {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kBuffered = 4096;

}  // namespace

RobotLogs::RobotLogs(const fs::path& run_directory, const TickLength& tick_length, Tick first, const Share& share)
    : folder_(run_directory / "logs"), tick_length_(tick_length) {
  cut(first, share);
}

RobotLogs::~RobotLogs() {
  try {
    flush();
  } catch (const RunError&) {
    // The run has ended with the same full disk.
  }
}

fs::path RobotLogs::file_of(std::uint32_t robot) const {
  char name[32];
  std::snprintf(name, sizeof name, "robot-%05u.txt", robot);
  return folder_ / name;
}

void RobotLogs::cut(Tick first, const Share& share) {
  std::error_code error;
  if (!fs::is_directory(folder_, error)) return;
  for (std::uint32_t robot = share.first; robot < share.first + share.size(); ++robot) {
    const auto text = os::read_if_there(file_of(robot));
    if (!text) continue;
    std::size_t kept = 0;
    while (kept < text->size() &&
           std::strtod(text->c_str() + kept, nullptr) < tick_length_.seconds_at(first) - 0.00051) {
      const std::size_t end = text->find('\n', kept);
      kept = end == std::string::npos ? text->size() : end + 1;
    }
    fs::resize_file(file_of(robot), kept, error);
    logs_[robot].octets = kept;
  }
}

void RobotLogs::append(double time_s, const std::string& text, Log& log) const {
  char prefix[32];
  std::snprintf(prefix, sizeof prefix, "%.3f ", time_s);
  for (const char c : text) {
    if (log.octets >= kMostOctets) return;
    const std::size_t before = log.text.size();
    if (log.at_line_start) log.text += prefix;
    log.text += c;
    log.at_line_start = c == '\n';
    log.octets += log.text.size() - before;
    if (log.octets >= kMostOctets) log.text += "\n(this robot's log ends here: it has reached 1 MiB)\n";
  }
}

void RobotLogs::write(Tick from, const std::vector<BehavioursEngine::Printed>& printed) {
  for (const auto& [robot, text] : printed) append(tick_length_.seconds_at(from), text, logs_[robot]);
  for (const auto& part : printed) {
    if (logs_[part.robot].text.size() < kBuffered) continue;
    flush();
    break;
  }
}

void RobotLogs::flush() {
  for (auto& [robot, log] : logs_) {
    if (log.text.empty()) continue;
    std::error_code error;
    fs::create_directories(folder_, error);
    std::ofstream file(file_of(robot), std::ios::app | std::ios::binary);
    file << log.text;
    file.close();
    if (!file) throw RunError(file_of(robot).string() + ": cannot be written; is the disk full?");
    log.text.clear();
  }
}

}  // namespace kilotwin::behaviours
