#include "core/base/say.hpp"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

namespace kilotwin {
namespace {

constexpr std::string_view kProgram = "kilotwin: ";

/// Own logger, because spdlog's default logger writes to stdout. Each line is one write, so lines of threads and processes do not mix.
spdlog::logger& logger() {
  static spdlog::logger lines = [] {
    spdlog::logger made("", std::make_shared<spdlog::sinks::stderr_sink_mt>());
    made.set_pattern("%v");
    return made;
  }();
  return lines;
}

std::string federate;

void write(spdlog::level::level_enum level, std::string_view line) {
  if (!federate.empty() && line.starts_with(kProgram)) line.remove_prefix(kProgram.size());
  logger().log(level, spdlog::string_view_t(line.data(), line.size()));
}

}  // namespace

void say(const std::string& line) { write(spdlog::level::info, line); }
void warn(const std::string& line) { write(spdlog::level::warn, line); }
void say_error(const std::string& line) { write(spdlog::level::err, line); }

void log_as(const std::string& name) {
  federate = name;
  logger().set_pattern("[%Y-%m-%dT%H:%M:%S.%eZ] [" + name + "] [%l] %v", spdlog::pattern_time_type::utc);
}

std::string_view error_text(std::string_view line) {
  std::string_view rest = line, level;
  for (int part = 0; part < 3; ++part) {
    const std::size_t end = rest.find("] ");
    if (!rest.starts_with('[') || end == std::string_view::npos) return line;
    level = rest.substr(1, end - 1);
    rest.remove_prefix(end + 2);
  }
  return level == "error" ? rest : std::string_view();
}

std::string one_line(std::string_view text, std::size_t longest) {
  std::string line{text};
  if (line.size() > longest) {
    line = text.substr(0, longest / 2);
    line.append("...").append(text.substr(text.size() - longest / 2));
  }
  for (char& c : line) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  }
  return line;
}

}  // namespace kilotwin
