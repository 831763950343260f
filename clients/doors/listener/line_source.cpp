#include "clients/doors/listener/line_source.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <thread>

#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "core/os/files.hpp"

namespace kilotwin::doors {
namespace {

constexpr std::size_t kLongestLine = 4096;
/// How soon a file that has ended is looked at again, and a port that has vanished.
constexpr auto kPause = std::chrono::milliseconds(10), kRetry = std::chrono::milliseconds(200);

speed_t speed_of(int baud) {
  switch (baud) {
    case 9600: return B9600;
    case 19200: return B19200;
    case 38400: return B38400;
    case 57600: return B57600;
    case 115200: return B115200;
    case 230400: return B230400;
    default: return B0;
  }
}

}  // namespace

LineSource::LineSource(std::filesystem::path place, int baud) : place_(std::move(place)), baud_(baud) {
  if (speed_of(baud) == B0)
    throw UserError(fmt::format("--baud {}: takes 9600, 19200, 38400, 57600, 115200 or 230400", baud));
  const std::string why = open();
  if (!why.empty()) throw UserError(fmt::format("{}: cannot be opened: {}", one_line(place_.string()), why));
}

/// Returns why it cannot, or an empty string.
std::string LineSource::open() {
  port_.reset(::open(place_.c_str(), O_RDONLY | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  struct stat status {};
  if (port_.get() < 0 || fstat(port_.get(), &status) != 0) return os::system_reason();
  if (S_ISDIR(status.st_mode)) {
    port_.reset();
    return "it is a directory; name a serial port or a file";
  }
  is_file_ = S_ISREG(status.st_mode);
  termios settings{};
  if (isatty(port_.get()) == 0 || tcgetattr(port_.get(), &settings) != 0) return {};
  cfmakeraw(&settings);
  settings.c_cflag |= CLOCAL | CREAD;
  cfsetspeed(&settings, speed_of(baud_));
  return tcsetattr(port_.get(), TCSANOW, &settings) == 0 ? std::string() : os::system_reason();
}

void LineSource::lose() {
  say(fmt::format("kilotwin: {}: the port is gone; waiting for it", one_line(place_.string())));
  port_.reset();
  line_.clear();
}

void LineSource::take(const char* octets, std::size_t count, std::vector<std::string>& lines) {
  for (std::size_t i = 0; i < count; ++i) {
    if (octets[i] == '\n') {
      lines.push_back(std::move(line_));
      line_.clear();
    } else if (line_.size() < kLongestLine) {
      line_ += octets[i];
    }
  }
}

std::vector<std::string> LineSource::read(double seconds) {
  std::vector<std::string> lines;
  if (port_.get() < 0) {
    if (open().empty()) {
      say(fmt::format("kilotwin: {}: the port is back", one_line(place_.string())));
    } else {
      std::this_thread::sleep_for(
          std::min<std::chrono::duration<double>>(kRetry, std::chrono::duration<double>(seconds)));
      return lines;
    }
  }
  if (!is_file_) {
    pollfd event{port_.get(), POLLIN, 0};
    constexpr double kMsPerS = 1e3;
    if (poll(&event, 1, static_cast<int>(seconds * kMsPerS)) <= 0) return lines;
  }
  char octets[4096];
  const ssize_t count = ::read(port_.get(), octets, sizeof octets);
  at_end_ = count == 0;
  if (count > 0) take(octets, static_cast<std::size_t>(count), lines);
  if (count == 0 && is_file_) std::this_thread::sleep_for(kPause);
  const bool is_gone = (count == 0 && !is_file_) || (count < 0 && errno != EAGAIN && errno != EINTR);
  if (is_gone) lose();
  return lines;
}

}  // namespace kilotwin::doors
