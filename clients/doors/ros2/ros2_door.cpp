#include "clients/doors/ros2/ros2_door.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "core/base/clocks.hpp"

namespace kilotwin::doors::ros2 {
namespace {

/// How often published poses are looked for.
constexpr std::int64_t kPublishEvery_ns = 5'000'000;

}  // namespace

dds::Transport transport_of(const Discovery& discovery) {
  dds::Transport transport;
  transport.domain = discovery.domain;
  transport.user_data = kEnclave;
  transport.configuration = discovery.configuration;
  if (!transport.configuration.empty()) return transport;
  const bool local = !discovery.multicast && discovery.peers.empty();
  std::string peers;
  if (!discovery.multicast) peers = R"(<Peer Address="127.0.0.1"/>)";
  for (const std::string& peer : discovery.peers) peers += fmt::format(R"(<Peer Address="{}"/>)", peer);
  transport.configuration = fmt::format(
      R"(<CycloneDDS><Domain id="any"><General>{}<AllowMulticast>{}</AllowMulticast></General>)"
      R"(<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>{}</MaxAutoParticipantIndex>)"
      R"({}</Discovery></Domain></CycloneDDS>)",
      local ? R"(<Interfaces><NetworkInterface name="lo"/></Interfaces>)" : "", discovery.multicast, kLastIndex,
      peers.empty() ? "" : "<Peers>" + peers + "</Peers>");
  return transport;
}

Ros2Door::Ros2Door(Door door, const dds::Transport& run, const Discovery& ros)
    : door_(std::move(door)),
      run_(run),
      ros_(transport_of(ros)),
      writer_(run_, door_.settings.name()),
      maker_(door_, topics_of(door_)),
      readers_(ros_, maker_.topics(), inbox_) {
  const proto::Ros2Publish& publish = door_.settings.ros2().publish();
  if (publish.has_poses() || publish.clock()) publisher_ = std::make_unique<RunPublisher>(door_, run_, ros_);
}

void Ros2Door::serve(std::int64_t wait_ns) {
  const std::int64_t end_ns = steady_ns() + wait_ns;
  for (std::int64_t now_ns = steady_ns(); now_ns < end_ns; now_ns = steady_ns()) {
    std::int64_t until_ns = std::min(end_ns, maker_.deadline_ns().value_or(end_ns));
    if (publisher_) until_ns = std::min(until_ns, now_ns + kPublishEvery_ns);
    const std::uint64_t lost_before = lost_;
    const std::vector<Inbox::Item> items = inbox_.take(until_ns, lost_);
    for (std::uint64_t i = lost_before; i < lost_; ++i)
      maker_.tally().left_out("messages that came faster than they were read");
    for (const Inbox::Item& item : items) send(maker_.add(item, steady_ns()));
    send(maker_.expire(steady_ns()));
    if (publisher_) publisher_->publish();
  }
}

void Ros2Door::send(std::vector<TrackedFrame> frames) {
  for (TrackedFrame& frame : frames) {
    // Where the source's clock shows UTC, so does this machine's.
    if (frame.utc) frame.sent_ns = utc_ns();
    writer_.write(frame);
  }
}

}  // namespace kilotwin::doors::ros2
