#include "clients/mcap/printed_lines.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <string_view>

#include "core/logs/robot_logs.hpp"
#include "core/os/files.hpp"

namespace kilotwin::mcap {
namespace {

/// Lines begin with their time; one that does not was begun by the line before it, or says that the log is full.
PrintedLines::Line line_of(std::string_view text, double time_before_s, std::uint32_t robot) {
  double time_s = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), time_s);
  const auto length = static_cast<std::size_t>(end - text.data());
  if (error != std::errc{} || length == text.size() || text[length] != ' ')
    return {time_before_s, robot, std::string{text}};
  return {time_s, robot, std::string{text.substr(length + 1)}};
}

}  // namespace

PrintedLines::PrintedLines(const std::filesystem::path& run_directory, std::uint32_t robots) {
  std::size_t octets = 0;
  for (std::uint32_t robot = 0; robot < robots; ++robot) {
    const std::optional<std::string> log = os::read_if_there(RobotLogs::file_in(run_directory, robot));
    if (!log) continue;
    octets += log->size();
    if (octets > kMostOctets) {
      lines_.push_back(
          {lines_.empty() ? 0 : lines_.back().time_s, robot,
           fmt::format("(the logs hold more than {} MiB; robots from here on are left out)", kMostOctets >> 20)});
      break;
    }
    double time_s = 0;
    for (std::string_view left = *log; !left.empty();) {
      const std::size_t end = std::min(left.find('\n'), left.size());
      lines_.push_back(line_of(left.substr(0, end), time_s, robot));
      time_s = lines_.back().time_s;
      left.remove_prefix(std::min(end + 1, left.size()));
    }
  }
  std::stable_sort(lines_.begin(), lines_.end(), [](const Line& a, const Line& b) { return a.time_s < b.time_s; });
}

const PrintedLines::Line* PrintedLines::next_before(double end_s) {
  if (next_ == lines_.size() || lines_[next_].time_s >= end_s) return nullptr;
  return &lines_[next_++];
}

}  // namespace kilotwin::mcap
