#include "clients/ohc/real_controller.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>

#include "clients/ohc/guard.hpp"
#include "clients/ohc/packet_log.hpp"
#include "clients/ohc/packet_queue.hpp"
#include "clients/ohc/run_watch.hpp"
#include "clients/ohc/serial_port.hpp"
#include "clients/ohc/stop_rule.hpp"
#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "core/federation/topics.hpp"
#include "core/os/interrupt.hpp"

namespace kilotwin::ohc {
namespace {

using Clock = std::chrono::steady_clock;

/// Packets of the station, each at its offset within the tick.
class StationPackets {
 public:
  explicit StationPackets(const dds::Participant& participant)
      : reader_(participant, topics::station_packets(),
                [this](const PublicStationPacket& sample, dds::SampleState state) {
                  if (state.valid) receive(sample);
                }) {}

  /// The next packet that is due. Waits for one until `until`.
  std::optional<OverheadPacket> take(Clock::time_point until) {
    std::unique_lock lock(mutex_);
    for (;;) {
      const Clock::time_point now = Clock::now();
      if (auto packet = queue_.take(now)) return packet;
      if (now >= until) return std::nullopt;
      arrived_.wait_until(lock, std::min(until, queue_.next_due().value_or(until)));
    }
  }
  /// Drops all that waits.
  void clear() {
    const std::lock_guard lock(mutex_);
    queue_.clear();
  }
  /// Packets that were dropped because the line is slower than the station.
  [[nodiscard]] std::uint64_t dropped() const {
    const std::lock_guard lock(mutex_);
    return queue_.dropped();
  }
  /// Packets that did not come: gaps in the station's count.
  [[nodiscard]] std::uint64_t lost() const {
    const std::lock_guard lock(mutex_);
    return lost_;
  }

 private:
  void receive(const PublicStationPacket& sample) {
    constexpr double kLongestOffset_s = 1.0;
    OverheadPacket packet;
    packet.command = static_cast<OverheadCommand>(sample.command);
    if (!is_known(packet.command) || !(sample.offset_s >= 0 && sample.offset_s < kLongestOffset_s)) return;
    std::copy_n(sample.message, packet.message.size(), packet.message.begin());
    std::copy_n(sample.rest, packet.rest.size(), packet.rest.begin());
    const auto due = Clock::now() + std::chrono::nanoseconds(static_cast<std::int64_t>(sample.offset_s * 1e9));
    const std::lock_guard lock(mutex_);
    if (run_ == sample.run && sample.number > next_) lost_ += sample.number - next_;
    run_ = sample.run;
    next_ = sample.number + 1;
    queue_.put(packet, due);
    arrived_.notify_one();
  }

  mutable std::mutex mutex_;
  std::condition_variable arrived_;
  PacketQueue queue_;
  std::uint64_t run_ = 0, next_ = 0, lost_ = 0;
  dds::Reader<PublicStationPacket> reader_;
};

class RealController {
 public:
  RealController(Guard& guard, std::string device, std::uint32_t domain)
      : guard_(guard),
        device_(std::move(device)),
        participant_({domain, {}}),
        watch_(participant_),
        announcer_(watch_, domain),
        station_(participant_) {}

  void work() {
    while (interrupted() == 0) {
      watch_run();
      for (const auto until = Clock::now() + StopRule::kLook; Clock::now() < until && interrupted() == 0;) {
        const auto packet = station_.take(until);
        if (!packet) continue;
        forward(*packet);
        stop_rule_.forwarded();
      }
      if (!guard_.runs()) take_over();
    }
  }

  void report() const {
    say(fmt::format("kilotwin: {}, {} dropped as the line was busy, {} lost on the way", log_.counts(),
                    station_.dropped(), station_.lost()));
  }

 private:
  void watch_run() {
    announcer_.look();
    const StopRule::Verdict verdict = stop_rule_.look(watch_.heard(), Clock::now());
    if (verdict.stop) {
      station_.clear();
      forward({});
    }
    if (verdict.news == StopRule::News::kSilent) {
      say(fmt::format("kilotwin: no status of the run for {:g} s: the robots get STOP until its station is back",
                      std::chrono::duration<double>(StopRule::kLongestSilence).count()));
    }
    if (verdict.news == StopRule::News::kBack) say("kilotwin: the station is back");
  }

  /// Returns when the line is free for the next packet.
  void forward(const OverheadPacket& packet) {
    log_.note(packet, std::chrono::duration<double>(Clock::now() - begun_).count());
    if (!send_packet(guard_.socket(), packet) && !guard_.runs()) take_over();
  }

  /// The guard has been killed: nobody but this process can send STOP.
  [[noreturn]] void take_over() const {
    SerialPort port(device_);
    const bool stopped = port.open().empty() && port.send({});
    throw RunError(device_ + ": the guard process of the port was killed; " +
                   (stopped ? "STOP was sent" : "STOP could not be sent: switch the controller off"));
  }

  Guard& guard_;
  const std::string device_;
  dds::Participant participant_;
  RunWatch watch_;
  RunAnnouncer announcer_;
  StationPackets station_;
  PacketLog log_;
  const Clock::time_point begun_ = Clock::now();
  StopRule stop_rule_;
};

}  // namespace

void run_real_controller(const std::filesystem::path& device, std::uint32_t domain) {
  SerialPort port(device);
  if (const std::string reason = port.open(); !reason.empty()) {
    throw UserError(device.string() + ": cannot be opened: " + reason +
                    "; name the controller's port, and see that no other program has it");
  }
  Guard guard([&](int socket) { serve_port(port, socket); });
  port.close();
  catch_interrupts();
  RealController controller(guard, device.string(), domain);
  say(fmt::format("kilotwin: {}: the station's packets go to this port", device.string()));
  controller.work();
  controller.report();
}

}  // namespace kilotwin::ohc
