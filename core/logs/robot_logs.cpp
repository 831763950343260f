#include "core/logs/robot_logs.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cstdlib>
#include <exception>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "core/os/files.hpp"

namespace kilotwin {
namespace fs = std::filesystem;
namespace {

/// Text is written to the files when this many octets wait, or when the oldest has waited for this many ticks (one second).
constexpr std::size_t kBuffered = 4096;
constexpr std::int64_t kPatience = 31;

/// The number in robot-NUMBER.txt, or -1 if the name has another form.
std::int64_t robot_of(const fs::path& file) {
  constexpr std::string_view kBefore = "robot-", kAfter = ".txt";
  const std::string name = file.filename().string();
  if (!name.starts_with(kBefore)) return -1;
  std::uint32_t robot = 0;
  const char* const last = name.data() + name.size();
  const auto [end, error] = std::from_chars(name.data() + kBefore.size(), last, robot);
  return error == std::errc() && std::string_view(end, last) == kAfter ? std::int64_t{robot} : -1;
}

}  // namespace

RobotLogs::RobotLogs(const fs::path& run_directory, const TickLength& tick_length, Tick first,
                     const std::function<bool(std::uint32_t)>& own)
    : folder_(run_directory / "logs"), tick_length_(tick_length) {
  cut(first, own);
}

RobotLogs::~RobotLogs() {
  try {
    flush();
  } catch (const RunError& error) {
    say(error.what());
  }
}

fs::path RobotLogs::file_in(const fs::path& run_directory, std::uint32_t robot) {
  return run_directory / "logs" / fmt::format("robot-{:05}.txt", robot);
}

fs::path RobotLogs::file_of(std::uint32_t robot) const { return file_in(folder_.parent_path(), robot); }

void RobotLogs::cut(Tick first, const std::function<bool(std::uint32_t)>& own) {
  std::error_code none;
  std::vector<std::uint32_t> robots;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_, none)) {
    const std::int64_t robot = robot_of(entry.path());
    if (robot >= 0 && own(static_cast<std::uint32_t>(robot))) robots.push_back(static_cast<std::uint32_t>(robot));
  }
  // Times are printed in whole ms, so a line of tick `first` may begin up to half a millisecond below the tick's time.
  const double end_s = tick_length_.seconds_at(first) - 0.00051;
  for (const std::uint32_t robot : robots) {
    const std::string text = os::read_file(file_of(robot));
    std::size_t kept = 0;
    while (kept < text.size() && std::strtod(text.c_str() + kept, nullptr) < end_s) {
      const std::size_t end = text.find('\n', kept);
      kept = end == std::string::npos ? text.size() : end + 1;
    }
    std::error_code error;
    fs::resize_file(file_of(robot), kept, error);
    if (error) throw RunError(fmt::format("{}: cannot be shortened: {}", file_of(robot).string(), error.message()));
    logs_[robot].octets = kept;
  }
}

void RobotLogs::write(Tick from, std::uint32_t robot, std::string_view text) {
  Log& log = logs_[robot];
  const std::string prefix = fmt::format("{:.3f} ", tick_length_.seconds_at(from));
  const std::size_t before = log.text.size();
  for (const char c : text) {
    if (log.octets >= kMostOctets) break;
    const std::size_t length = log.text.size();
    if (log.at_line_start) log.text += prefix;
    log.text += c;
    log.at_line_start = c == '\n';
    log.octets += log.text.size() - length;
    if (log.octets >= kMostOctets) log.text += "\n(this robot's log ends here: it has reached 1 MiB)\n";
  }
  if (waiting_ == 0) waiting_since_ = from;
  waiting_ += log.text.size() - before;
  if (waiting_ >= kBuffered || from - waiting_since_ > kPatience) flush();
}

void RobotLogs::flush() {
  if (waiting_ == 0) return;
  waiting_ = 0;  // if a write fails, its text is lost: a retry would fail each second of a full disk
  std::error_code error;
  fs::create_directories(folder_, error);
  std::exception_ptr first;  // robots whose files can be written keep their lines
  for (auto& [robot, log] : logs_) {
    if (log.text.empty()) continue;
    const std::string text = std::exchange(log.text, {});
    try {
      os::OutputFile file(file_of(robot), os::OutputFile::Existing::kAppend);
      file.buffer() = text;
      file.close();
    } catch (const RunError&) {
      if (!first) first = std::current_exception();
    }
  }
  if (first) std::rethrow_exception(first);
}

}  // namespace kilotwin
