#include "clients/ohc/pseudo_terminal.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <system_error>

#include "core/base/error.hpp"
#include "core/os/files.hpp"

namespace kilotwin::ohc {

PseudoTerminal::PseudoTerminal() : own_(posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC)) {
  std::array<char, 64> name{};
  if (own_.get() < 0 || grantpt(own_.get()) != 0 || unlockpt(own_.get()) != 0 ||
      ptsname_r(own_.get(), name.data(), name.size()) != 0)
    throw RunError("no pseudo-terminal can be made: " + os::system_reason());
  path_ = name.data();
  other_.reset(open(name.data(), O_RDWR | O_NOCTTY | O_CLOEXEC));
  termios settings{};
  if (other_.get() < 0 || tcgetattr(other_.get(), &settings) != 0)
    throw RunError(path_ + ": cannot be opened: " + os::system_reason());
  cfmakeraw(&settings);
  cfsetspeed(&settings, B38400);
  tcsetattr(other_.get(), TCSANOW, &settings);
}

std::vector<std::uint8_t> PseudoTerminal::read(double seconds) {
  constexpr std::size_t kMost = 4096;
  pollfd event{own_.get(), POLLIN, 0};
  const timespec time{static_cast<time_t>(seconds), static_cast<long>(std::fmod(seconds, 1.0) * 1e9)};
  std::vector<std::uint8_t> octets;
  if (ppoll(&event, 1, &time, nullptr) <= 0) return octets;
  octets.resize(kMost);
  const ssize_t count = ::read(own_.get(), octets.data(), octets.size());
  octets.resize(count > 0 ? static_cast<std::size_t>(count) : 0);
  return octets;
}

void PseudoTerminal::hold_back(bool held) {
  if (held == held_) return;
  held_ = held;
  tcflow(other_.get(), held ? TCOOFF : TCOON);
}

int PseudoTerminal::tidy() {
  int exclusive = 0;
  if (ioctl(other_.get(), TIOCGEXCL, &exclusive) == 0 && exclusive != 0) ioctl(other_.get(), TIOCNXCL);
  termios settings{};
  if (tcgetattr(other_.get(), &settings) != 0) return 0;
  constexpr std::array<std::pair<speed_t, int>, 8> kSpeeds{{{B1200, 1200},
                                                            {B2400, 2400},
                                                            {B4800, 4800},
                                                            {B9600, 9600},
                                                            {B19200, 19200},
                                                            {B38400, 38400},
                                                            {B57600, 57600},
                                                            {B115200, 115200}}};
  for (const auto& [code, baud] : kSpeeds) {
    if (cfgetospeed(&settings) == code) return baud;
  }
  return 0;
}

void make_link(const std::filesystem::path& link, const std::string& path) {
  std::error_code error;
  if (std::filesystem::is_symlink(link, error) && !std::filesystem::exists(link, error))
    std::filesystem::remove(link, error);
  if (std::filesystem::exists(std::filesystem::symlink_status(link, error)))
    throw UserError(link.string() + ": exists; remove it or name another place for the port");
  std::filesystem::create_symlink(path, link, error);
  if (error)
    throw UserError(link.string() + ": cannot be made: " + error.message() +
                    "; name a place in a directory that you may write to");
}

void remove_link(const std::filesystem::path& link, const std::string& path) {
  std::error_code error;
  if (std::filesystem::read_symlink(link, error) == path && !error) std::filesystem::remove(link, error);
}

}  // namespace kilotwin::ohc
