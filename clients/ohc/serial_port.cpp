#include "clients/ohc/serial_port.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <optional>
#include <thread>

#include "clients/ohc/call_limit.hpp"
#include "core/base/say.hpp"
#include "core/os/files.hpp"
#include "core/os/interrupt.hpp"

namespace kilotwin::ohc {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

/// Between the two STOPs at the end. kPage_s is the pace of pages, whose loss a program's next pass mends; nothing mends the loss of
/// the last STOP, and a port may hold octets back that it has reported as sent. So this one has half a page to spare.
constexpr milliseconds kPageTime{150};
constexpr milliseconds kRetry{500};
/// A controller that opening the port has reset listens after this.
constexpr milliseconds kStartUp{2200};

/// The loop of serve_port().
class PortServer {
 public:
  PortServer(SerialPort& port, int socket) : port_(port), socket_(socket) {}

  void work() {
    while (serve()) {}
    stop();
  }

 private:
  /// Waits for something to happen, and does it. False once the socket has ended.
  bool serve() {
    pollfd event{socket_, POLLIN, 0};
    const int ready = poll(&event, 1, static_cast<int>(kRetry.count()));
    if (ready > 0) {
      std::string octets(2 * kSerialPacket, '\0');
      const ssize_t count = recv(socket_, octets.data(), octets.size(), 0);
      if (count <= 0) return false;
      octets.resize(static_cast<std::size_t>(count));
      if (const auto packet = packet_of(octets)) forward(*packet);
      const char done = 1;
      static_cast<void>(::send(socket_, &done, sizeof done, MSG_NOSIGNAL));
    }
    if (port_.is_open() && port_.is_gone()) lose("it is gone");
    if (!port_.is_open() && Clock::now() >= next_try_) regain();
    if (repeat_at_ && Clock::now() >= *repeat_at_) repeat();
    return true;
  }

  void forward(const OverheadPacket& packet) {
    last_ = packet;
    if (!port_.is_open()) return;
    if (!port_.send(packet)) return lose(port_.failure());
    if (packet.command == OverheadCommand::kBootPage)
      std::this_thread::sleep_for(std::chrono::duration<double>(kPage_s));
  }

  void lose(const std::string& why) {
    port_.close();
    repeat_at_.reset();
    next_try_ = Clock::now() + kRetry;
    if (why == lost_by_) return;
    lost_by_ = why;
    say(fmt::format("kilotwin: {}: the port is lost: {}; waiting for it", port_.device().string(), why));
  }

  void regain() {
    next_try_ = Clock::now() + kRetry;
    if (!port_.open().empty()) return;
    if (last_ && !port_.send(*last_)) return lose(port_.failure());
    lost_by_.clear();
    say(fmt::format("kilotwin: {}: the port is back", port_.device().string()));
    repeat_at_ = Clock::now() + kStartUp;
  }

  /// Sends again the last command, which the controller was sent while it started.
  void repeat() {
    repeat_at_.reset();
    const bool lasts =
        last_ && (last_->command == OverheadCommand::kRepeat || last_->command == OverheadCommand::kRaw);
    if (lasts && port_.is_open() && !port_.send(*last_)) lose(port_.failure());
  }

  /// Twice, as a controller is deaf while it sends a page.
  void stop() {
    if (!port_.is_open() && !port_.open().empty()) {
      say(fmt::format("kilotwin: {}: the port is gone, and STOP could not be sent: switch the controller off",
                      port_.device().string()));
      return;
    }
    bool sent = port_.send({});
    std::this_thread::sleep_for(kPageTime);
    sent = port_.send({}) || sent;
    if (!sent) {
      say(fmt::format("kilotwin: {}: STOP could not be sent: {}; switch the controller off",
                      port_.device().string(), port_.failure()));
    }
  }

  SerialPort& port_;
  const int socket_;
  std::optional<OverheadPacket> last_;
  std::string lost_by_;  ///< why the port is lost; empty: it is not
  std::optional<Clock::time_point> repeat_at_ = Clock::now() + kStartUp;
  Clock::time_point next_try_{};
};

}  // namespace

std::string SerialPort::open() {
  os::Descriptor port(::open(device_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  termios settings{};
  if (port.get() < 0 || ioctl(port.get(), TIOCEXCL) != 0 || tcgetattr(port.get(), &settings) != 0)
    return os::system_reason();
  cfmakeraw(&settings);
  cfsetspeed(&settings, B38400);
  settings.c_cflag &= ~static_cast<tcflag_t>(CSTOPB | PARENB | CRTSCTS);
  settings.c_cflag |= CREAD | CLOCAL | CS8;
  settings.c_cc[VMIN] = settings.c_cc[VTIME] = 0;
  if (tcsetattr(port.get(), TCSAFLUSH, &settings) != 0) return os::system_reason();
  tcflush(port.get(), TCIOFLUSH);
  port_ = std::move(port);
  return {};
}

void SerialPort::close() {
  if (is_open()) tcflush(port_.get(), TCOFLUSH);
  port_.reset();
}

bool SerialPort::fail(std::string reason) {
  failure_ = std::move(reason);
  return false;
}

std::string SerialPort::stalled() const {
  return fmt::format("it has taken no octets for {:g} s; unplug the adapter and plug it in again",
                     std::chrono::duration<double>(patience_).count());
}

/// Until the last octet is through. The system itself would wait for an adapter that is stuck for ever.
bool SerialPort::drain() {
  const Clock::time_point until = Clock::now() + patience_;
  const CallLimit limit(patience_);
  while (tcdrain(port_.get()) != 0) {
    if (errno != EINTR) return fail("it is gone");
    if (Clock::now() >= until) return fail(stalled());
  }
  return true;
}

bool SerialPort::send(const OverheadPacket& packet) {
  const SerialPacket octets = encode(packet);
  for (std::size_t sent = 0; sent < octets.size();) {
    const ssize_t count = write(port_.get(), octets.data() + sent, octets.size() - sent);
    if (count > 0) {
      sent += static_cast<std::size_t>(count);
      continue;
    }
    if (count < 0 && errno == EINTR) continue;
    if (count < 0 && errno != EAGAIN) return fail("it is gone");
    pollfd event{port_.get(), POLLOUT, 0};
    const int ready = poll(&event, 1, static_cast<int>(patience_.count()));
    if (ready < 0 && errno == EINTR) continue;
    if (ready <= 0) return fail(stalled());
    if ((event.revents & (POLLHUP | POLLERR)) != 0) return fail("it is gone");
  }
  return drain();
}

bool SerialPort::is_gone() const {
  pollfd event{port_.get(), 0, 0};
  return poll(&event, 1, 0) > 0 && (event.revents & (POLLHUP | POLLERR | POLLNVAL)) != 0;
}

void serve_port(SerialPort& port, int socket) { PortServer(port, socket).work(); }

bool send_packet(int socket, const OverheadPacket& packet) {
  const std::string octets = octets_of(packet);
  if (send(socket, octets.data(), octets.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(octets.size())) return false;
  char done = 0;
  ssize_t count = 0;
  do {
    count = recv(socket, &done, sizeof done, 0);
  } while (count < 0 && errno == EINTR && interrupted() == 0);
  return count > 0;
}

}  // namespace kilotwin::ohc
