#include "clients/ohc/virtual_controller.hpp"

#include <fmt/format.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>

#include "clients/ohc/guard.hpp"
#include "clients/ohc/line_clock.hpp"
#include "clients/ohc/packet_log.hpp"
#include "clients/ohc/pseudo_terminal.hpp"
#include "clients/ohc/run_watch.hpp"
#include "core/base/say.hpp"
#include "core/federation/topics.hpp"
#include "core/os/interrupt.hpp"

namespace kilotwin::ohc {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int kBaud = 38400;
/// How long to wait for octets: while the line is busy; while it is idle.
constexpr double kBusyWait_s = 0.004, kIdleWait_s = 0.1;

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

class VirtualController {
 public:
  VirtualController(PseudoTerminal& terminal, std::uint32_t domain)
      : terminal_(terminal),
        participant_({domain, {}}),
        packets_(participant_, topics::overhead_packets()),
        watch_(participant_),
        announcer_(watch_, domain) {
    fmt::format("ohc {}", getpid()).copy(sample_.client, sizeof sample_.client - 1);
  }

  void work() {
    while (interrupted() == 0) {
      const double now_s = seconds_since(begun_);
      if (now_s >= next_look_s_) look(now_s);
      const double wait_s = line_.idle() ? kIdleWait_s : std::clamp(line_.done_s() - now_s, 0.0, kBusyWait_s);
      const std::vector<std::uint8_t> octets = terminal_.read(wait_s);
      if (!octets.empty()) line_.put(octets, seconds_since(begun_));
      for (const double until_s = seconds_since(begun_); const auto octet = line_.take(until_s);) take(*octet);
      terminal_.hold_back(!line_.idle());
    }
    terminal_.hold_back(false);
  }

  void report() const {
    const PacketDecoder::Counters& counters = decoder_.counters();
    say(fmt::format("kilotwin: {} octets, {}, {} wrong checksums, {} of an unknown type", counters.octets + deaf_,
                    log_.counts(), counters.bad_checksums, counters.unknown_types));
    if (deaf_ > 0) say(fmt::format("kilotwin: {} octets came while the controller started or sent a page", deaf_));
    if (unheard_ > 0) say(fmt::format("kilotwin: {} packets came while there was no run", unheard_));
  }

 private:
  void look(double now_s) {
    constexpr double kEvery_s = 0.2;
    next_look_s_ = now_s + kEvery_s;
    announcer_.look();
    const int baud = terminal_.tidy();
    if (baud == baud_) return;
    baud_ = baud;
    if (baud != kBaud)
      say(fmt::format("kilotwin: the port is set to {} baud; a real controller understands 38400 only", baud));
  }

  void take(const LineClock::Octet& octet) {
    if (octet.at_s < deaf_until_s_) {
      ++deaf_;
      return;
    }
    const std::optional<OverheadPacket> packet = decoder_.take(octet.value);
    if (!packet) return;
    log_.note(*packet, octet.at_s);
    if (packet->command == OverheadCommand::kBootPage) deaf_until_s_ = octet.at_s + kPage_s;
    if (packets_.readers() == 0) {
      ++unheard_;
      return;
    }
    const std::chrono::duration<double> ago(seconds_since(begun_) - octet.at_s);
    const auto arrived = std::chrono::system_clock::now().time_since_epoch() - ago;
    ++sample_.request;
    sample_.command = static_cast<std::uint8_t>(packet->command);
    std::copy(packet->message.begin(), packet->message.end(), sample_.message);
    std::copy(packet->rest.begin(), packet->rest.end(), sample_.rest);
    sample_.arrived_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(arrived).count();
    packets_.write(sample_);
  }

  PseudoTerminal& terminal_;
  const Clock::time_point begun_ = Clock::now();
  dds::Participant participant_;
  dds::Writer<PublicOverheadPacket> packets_;
  RunWatch watch_;
  RunAnnouncer announcer_;
  PublicOverheadPacket sample_{};
  LineClock line_;
  PacketDecoder decoder_;
  PacketLog log_;
  double next_look_s_ = 0;
  double deaf_until_s_ = kStartUp_s;
  int baud_ = kBaud;
  std::uint64_t deaf_ = 0, unheard_ = 0;
};

}  // namespace

void run_virtual_controller(const std::filesystem::path& link, std::uint32_t domain) {
  PseudoTerminal terminal;
  const std::filesystem::path place = std::filesystem::absolute(link);
  make_link(place, terminal.path());
  const Guard guard([&](int socket) {
    char octet = 0;
    while (recv(socket, &octet, 1, 0) > 0) {}
    remove_link(place, terminal.path());
  });
  catch_interrupts();
  VirtualController controller(terminal, domain);
  say(fmt::format("kilotwin: {} leads to {}: a virtual overhead controller, which listens in {:g} s", link.string(),
                  terminal.path(), kStartUp_s));
  controller.work();
  controller.report();
}

}  // namespace kilotwin::ohc
