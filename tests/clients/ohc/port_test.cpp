// Ports: the pseudo-terminal that station programs open, and the port of a physical controller, played by a pseudo-terminal.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <future>
#include <memory>
#include <thread>
#include <vector>

#include "clients/ohc/call_limit.hpp"
#include "clients/ohc/guard.hpp"
#include "clients/ohc/pseudo_terminal.hpp"
#include "clients/ohc/serial_port.hpp"
#include "core/base/error.hpp"

namespace kilotwin::ohc {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

class Folder {
 public:
  Folder() : path_(fs::temp_directory_path() / ("kilotwin-ports-" + std::to_string(getpid()))) {
    fs::remove_all(path_);
    fs::create_directories(path_);
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  [[nodiscard]] fs::path operator/(const char* name) const { return path_ / name; }

 private:
  fs::path path_;
};

std::vector<std::uint8_t> read_octets(PseudoTerminal& terminal, std::size_t count) {
  std::vector<std::uint8_t> octets;
  for (const auto end = Clock::now() + std::chrono::seconds(20); octets.size() < count && Clock::now() < end;) {
    const auto more = terminal.read(0.05);
    octets.insert(octets.end(), more.begin(), more.end());
  }
  return octets;
}

/// The next packet that arrives at a controller within a bound against hanging.
OverheadPacket next_packet(PseudoTerminal& controller, PacketDecoder& decoder, std::vector<std::uint8_t>& pending) {
  for (const auto end = Clock::now() + std::chrono::seconds(30); Clock::now() < end;) {
    while (!pending.empty()) {
      const std::uint8_t octet = pending.front();
      pending.erase(pending.begin());
      if (const auto packet = decoder.take(octet)) return *packet;
    }
    pending = controller.read(0.05);
  }
  ADD_FAILURE() << "no packet came";
  return {};
}

TEST(PseudoTerminal, TakesEveryOctetAsASerialLineDoes) {
  PseudoTerminal terminal;
  std::vector<std::uint8_t> all(256);
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::uint8_t>(i);
  // Opened and closed by one program after another, for itself alone and with its own settings.
  for (int n = 0; n < 5; ++n) {
    SerialPort port(terminal.path());
    ASSERT_EQ(port.open(), "") << n;
    for (int packet = 0; packet < 3; ++packet) {
      const OverheadPacket sent{OverheadCommand::kRepeat, {static_cast<std::uint8_t>(n), 0x0a, 0x0d, 0x11, 0x13}};
      ASSERT_TRUE(port.send(sent));
      const auto octets = read_octets(terminal, kSerialPacket);
      const SerialPacket expected = encode(sent);
      EXPECT_TRUE(std::equal(octets.begin(), octets.end(), expected.begin(), expected.end()));
    }
    EXPECT_EQ(terminal.tidy(), 38400);
  }
  const int port = open(terminal.path().c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK);
  ASSERT_GE(port, 0);
  ASSERT_EQ(write(port, all.data(), all.size()), static_cast<ssize_t>(all.size()));
  EXPECT_EQ(read_octets(terminal, all.size()), all);
  std::uint8_t octet = 0;
  EXPECT_LE(read(port, &octet, 1), 0) << "it never answers";
  termios settings{};
  tcgetattr(port, &settings);
  cfsetspeed(&settings, B9600);
  tcsetattr(port, TCSANOW, &settings);
  EXPECT_EQ(terminal.tidy(), 9600);
  close(port);
}

TEST(PseudoTerminal, HoldsWritersBack) {
  PseudoTerminal terminal;
  const int port = open(terminal.path().c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK);
  ASSERT_GE(port, 0);
  const SerialPacket packet = encode({});
  terminal.hold_back(true);
  EXPECT_LT(write(port, packet.data(), packet.size()), 0);
  EXPECT_EQ(errno, EAGAIN);
  EXPECT_TRUE(terminal.read(0.01).empty());
  terminal.hold_back(false);
  EXPECT_EQ(write(port, packet.data(), packet.size()), static_cast<ssize_t>(packet.size()));
  EXPECT_EQ(read_octets(terminal, packet.size()).size(), packet.size());
  close(port);
}

TEST(PortLink, IsMadeOnlyWhereNothingIsAndRemovedOnlyIfItIsTheOwn) {
  const Folder folder;
  const fs::path link = folder / "ttyUSB0";
  make_link(link, "/dev/null");
  EXPECT_THROW(make_link(link, "/dev/zero"), UserError);
  remove_link(link, "/dev/zero");
  EXPECT_TRUE(fs::is_symlink(link));
  remove_link(link, "/dev/null");
  EXPECT_FALSE(fs::is_symlink(link));
  make_link(link, (folder / "nowhere").string());
  make_link(link, "/dev/null");  // a link to nowhere is in nobody's way
  EXPECT_EQ(fs::read_symlink(link), "/dev/null");
  std::ofstream(folder / "file") << "text";
  EXPECT_THROW(make_link(folder / "file", "/dev/null"), UserError);
  EXPECT_THROW(make_link(folder / "none" / "link", "/dev/null"), UserError);
}

TEST(SerialPort, SaysWhyItCannotBeOpened) {
  SerialPort missing("/nonexistent/port");
  EXPECT_NE(missing.open().find("No such file"), std::string::npos);
  SerialPort file("/dev/null");
  EXPECT_FALSE(file.open().empty());
}

/// tcdrain() of an adapter that is stuck never returns; no pseudo-terminal shows that, so a pipe stands for it.
TEST(CallLimit, EndsACallThatWouldNotReturn) {
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  std::atomic<bool> ended{false};
  // If the limit does nothing, an octet ends the call, and the test fails.
  std::jthread watchdog([&] {
    for (int i = 0; i < 200 && !ended; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(50));
    static_cast<void>(write(ends[1], "x", 1));
  });
  char octet = 0;
  {
    const CallLimit limit(std::chrono::milliseconds(30));
    // One that comes just before a call counts for the call.
    for (int n = 0; n < 2; ++n) {
      EXPECT_EQ(read(ends[0], &octet, 1), -1);
      EXPECT_EQ(errno, EINTR);
    }
  }
  ended = true;
  watchdog.join();
  EXPECT_EQ(read(ends[0], &octet, 1), 1) << "afterwards calls are as before";
  close(ends[0]);
  close(ends[1]);
}

TEST(CallLimit, IsNoneWhereTheSystemHasNoTimerLeft) {
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_SIGPENDING, &before), 0);
  rlimit none = before;
  none.rlim_cur = 0;  // each timer needs room for its signal
  ASSERT_EQ(setrlimit(RLIMIT_SIGPENDING, &none), 0);
  testing::internal::CaptureStderr();
  {
    const CallLimit limit(std::chrono::milliseconds(30));
    const CallLimit another(std::chrono::milliseconds(30));
  }
  const std::string said = testing::internal::GetCapturedStderr();
  ASSERT_EQ(setrlimit(RLIMIT_SIGPENDING, &before), 0);
  EXPECT_NE(said.find("no timer for the serial port"), std::string::npos) << said;
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 1) << "said once";
}

TEST(SerialPort, GivesAStalledAdapterUpAndSaysSo) {
  PseudoTerminal controller;
  SerialPort port(controller.path(), std::chrono::milliseconds(100));
  ASSERT_EQ(port.open(), "");
  controller.hold_back(true);
  EXPECT_FALSE(port.send({}));
  EXPECT_NE(port.failure().find("taken no octets for 0.1 s"), std::string::npos) << port.failure();
  port.close();
}

/// The guard goes on and serves the adapter when it takes octets again; nobody waits for it for ever.
TEST(ServePort, AStalledPortIsServedAgainWhenItMoves) {
  PseudoTerminal controller;
  PacketDecoder decoder;
  std::vector<std::uint8_t> pending;
  SerialPort port(controller.path(), std::chrono::milliseconds(100));
  ASSERT_EQ(port.open(), "");
  Guard guard([&](int socket) { serve_port(port, socket); });
  port.close();
  controller.hold_back(true);
  const OverheadPacket packet{OverheadCommand::kRepeat, {5}};
  ASSERT_TRUE(send_packet(guard.socket(), packet))
      << "it is confirmed, so that the station's packets do not pile up";
  EXPECT_TRUE(guard.runs());
  controller.hold_back(false);
  EXPECT_EQ(next_packet(controller, decoder, pending), packet) << "what it missed";
}

TEST(ServePort, ForwardsPacketsAndEndsWithStop) {
  PseudoTerminal controller;
  PacketDecoder decoder;
  std::vector<std::uint8_t> pending;
  std::vector<OverheadPacket> packets(3);
  packets[0] = {OverheadCommand::kRepeat, {1, 2, 3}};
  packets[1].command = OverheadCommand::kBootPage;
  packets[1].rest.fill(7);
  packets[2] = {OverheadCommand::kOnce, {9}};
  {
    SerialPort port(controller.path());
    ASSERT_EQ(port.open(), "");
    const Guard guard([&](int socket) { serve_port(port, socket); });
    port.close();
    for (const OverheadPacket& packet : packets) {
      ASSERT_TRUE(send_packet(guard.socket(), packet));
      EXPECT_EQ(next_packet(controller, decoder, pending), packet);
    }
  }
  EXPECT_EQ(next_packet(controller, decoder, pending), OverheadPacket{});
  EXPECT_EQ(decoder.counters().bad_checksums, 0u);
}

/// So that packets wait where they can still be dropped, and not in the guard's socket.
TEST(ServePort, APacketIsConfirmedOnceTheLineHasTakenIt) {
  PseudoTerminal controller;
  PacketDecoder decoder;
  std::vector<std::uint8_t> pending;
  SerialPort port(controller.path());
  ASSERT_EQ(port.open(), "");
  const Guard guard([&](int socket) { serve_port(port, socket); });
  port.close();
  controller.hold_back(true);
  const OverheadPacket packet{OverheadCommand::kOnce, {5}};
  std::future<bool> confirmed = std::async(std::launch::async, send_packet, guard.socket(), packet);
  EXPECT_EQ(confirmed.wait_for(std::chrono::milliseconds(200)), std::future_status::timeout);
  controller.hold_back(false);
  EXPECT_EQ(next_packet(controller, decoder, pending), packet);
  EXPECT_TRUE(confirmed.get());
}

/// A controller that sends a page has its interrupts off, and would lose the octets of the next packet.
TEST(ServePort, APageHasItsTime) {
  PseudoTerminal controller;
  SerialPort port(controller.path());
  ASSERT_EQ(port.open(), "");
  const Guard guard([&](int socket) { serve_port(port, socket); });
  port.close();
  const auto begin = Clock::now();
  OverheadPacket page;
  page.command = OverheadCommand::kBootPage;
  ASSERT_TRUE(send_packet(guard.socket(), page));
  EXPECT_GE(Clock::now() - begin, std::chrono::duration<double>(kPage_s));
}

TEST(ServePort, AKilledProcessIsFollowedByStop) {
  PseudoTerminal controller;
  PacketDecoder decoder;
  std::vector<std::uint8_t> pending;
  const pid_t worker = fork();
  if (worker == 0) {
    SerialPort port(controller.path());
    static_cast<void>(port.open());
    const Guard guard([&](int socket) { serve_port(port, socket); });
    port.close();
    static_cast<void>(send_packet(guard.socket(), {OverheadCommand::kRepeat, {0x55, 1}}));
    for (;;) pause();
  }
  EXPECT_EQ(next_packet(controller, decoder, pending), (OverheadPacket{OverheadCommand::kRepeat, {0x55, 1}}));
  kill(worker, SIGKILL);
  int status = 0;
  waitpid(worker, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status));
  EXPECT_EQ(next_packet(controller, decoder, pending), OverheadPacket{}) << "STOP";
}

TEST(ServePort, APortThatIsLostIsServedAgainWhenItIsBack) {
  const Folder folder;
  const fs::path device = folder / "device";
  auto controller = std::make_unique<PseudoTerminal>();
  make_link(device, controller->path());
  SerialPort port(device);
  ASSERT_EQ(port.open(), "");
  Guard guard([&](int socket) {
    controller.reset();  // the other side of the line is not this process's
    serve_port(port, socket);
  });
  port.close();
  PacketDecoder decoder;
  std::vector<std::uint8_t> pending;
  const OverheadPacket first{OverheadCommand::kRepeat, {1}}, second{OverheadCommand::kRepeat, {2}};
  ASSERT_TRUE(send_packet(guard.socket(), first));
  EXPECT_EQ(next_packet(*controller, decoder, pending), first);
  remove_link(device, controller->path());
  controller.reset();  // the plug is pulled
  ASSERT_TRUE(send_packet(guard.socket(), second));
  EXPECT_TRUE(guard.runs());
  controller = std::make_unique<PseudoTerminal>();
  make_link(device, controller->path());
  EXPECT_EQ(next_packet(*controller, decoder, pending), second) << "what it missed";
  EXPECT_TRUE(guard.runs());
}

}  // namespace
}  // namespace kilotwin::ohc
