#include "clients/view/robot_log.hpp"

#include <cstdlib>
#include <fstream>

#include "core/logs/robot_logs.hpp"

namespace kilotwin::view {

std::string log_until(const std::filesystem::path& file, double until_s) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return {};
  std::string text(RobotLogs::kMostOctets + 4096, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(in.gcount()));
  // Times ascend. A line that begins later is cut off, from the last one on.
  std::size_t end = text.size();
  while (end > 0) {
    const std::size_t before = end >= 2 ? text.rfind('\n', end - 2) : std::string::npos;
    const std::size_t line = before == std::string::npos ? 0 : before + 1;
    if (std::strtod(text.c_str() + line, nullptr) <= until_s) break;
    end = line;
  }
  text.resize(end);
  if (text.size() <= kMostLog_bytes) return text;
  const std::size_t cut = text.find('\n', text.size() - kMostLog_bytes);
  return cut == std::string::npos ? std::string() : text.substr(cut + 1);
}

}  // namespace kilotwin::view
