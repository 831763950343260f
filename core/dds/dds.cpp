#include "core/dds/dds.hpp"

#include <dds/ddsrt/log.h>
#include <fmt/format.h>

#include <map>
#include <mutex>

#include "core/base/error.hpp"

namespace kilotwin::dds {

std::string cyclone_configuration(const Transport& transport) {
  if (!transport.configuration.empty()) return transport.configuration;
  const bool local = transport.peers.empty();
  std::string peers;
  if (local) peers = R"(<Peer Address="127.0.0.1"/>)";
  for (const std::string& peer : transport.peers) peers += fmt::format(R"(<Peer Address="{}"/>)", peer);
  // Unicast only: `lo` has no multicast, and laboratory switches often drop it. Messages are as large as UDP allows, so
  // that a frame is one datagram. Participant indices go beyond 9, Cyclone's default limit of processes per machine.
  return fmt::format(
      R"(<CycloneDDS><Domain id="any"><General>{}<AllowMulticast>false</AllowMulticast>)"
      R"(<MaxMessageSize>65500B</MaxMessageSize><FragmentSize>64000B</FragmentSize></General>)"
      R"(<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>{}</MaxAutoParticipantIndex>)"
      R"(<LeaseDuration>{}ms</LeaseDuration><SPDPInterval>{}ms</SPDPInterval><Peers>{}</Peers></Discovery></Domain>)"
      R"(</CycloneDDS>)",
      local ? R"(<Interfaces><NetworkInterface name="lo"/></Interfaces>)" : "", kMostParticipants - 1,
      static_cast<int>(kLease_s * 1000), static_cast<int>(kAnnounceEvery_s * 1000), peers);
}

namespace {

/// Cyclone's last log message; error lines include it.
std::mutex log_mutex;
std::string last_log;

void remember_log(void*, const dds_log_data_t* data) {
  const std::lock_guard lock(log_mutex);
  last_log = data->message;
  last_log.erase(last_log.find_last_not_of(" \n") + 1);
}

std::string logged() {
  const std::lock_guard lock(log_mutex);
  return last_log.empty() ? "" : " (" + last_log + ")";
}

}  // namespace

Entity::Entity(dds_entity_t handle, const std::string& what) : handle_(handle) {
  if (handle < 0) {
    handle_ = 0;
    throw RunError(fmt::format("DDS: cannot make {}: {}{}", what, dds_strretcode(handle), logged()));
  }
}

Entity& Entity::operator=(Entity&& other) noexcept {
  std::swap(handle_, other.handle_);
  return *this;
}

Entity::~Entity() {
  if (handle_ > 0) dds_delete(handle_);
}

namespace {

struct SharedDomain {
  Entity entity;
  int users = 0;
};
std::mutex domains_mutex;
std::map<std::uint32_t, SharedDomain> domains;  // of this process

}  // namespace

Domain::Domain(const Transport& transport) : id_(transport.domain) {
  const std::lock_guard lock(domains_mutex);
  SharedDomain& shared = domains[id_];
  if (shared.users == 0) {
    dds_set_log_sink(remember_log, nullptr);
    const dds_entity_t domain = dds_create_domain(id_, cyclone_configuration(transport).c_str());
    if (domain < 0 && domain_is_full(id_)) {
      throw RunError(fmt::format(
          "DDS domain {} is full: {} processes of this machine take part in it, and no more can; end some, use "
          "fewer partitions and hosts, or choose another --domain",
          id_, kMostParticipants));
    }
    shared.entity = Entity(domain, fmt::format("domain {}", id_));
  }
  ++shared.users;
}

Domain::~Domain() {
  const std::lock_guard lock(domains_mutex);
  if (--domains[id_].users == 0) domains.erase(id_);
}

namespace {

struct QosDeleter {
  void operator()(dds_qos_t* qos) const { dds_delete_qos(qos); }
};
using Qos = std::unique_ptr<dds_qos_t, QosDeleter>;

Qos participant_qos(const Transport& transport) {
  Qos qos(dds_create_qos());
  if (!transport.user_data.empty())
    dds_qset_userdata(qos.get(), transport.user_data.data(), transport.user_data.size());
  return qos;
}

}  // namespace

Participant::Participant(const Transport& transport)
    : domain_(transport),
      participant_(dds_create_participant(transport.domain, participant_qos(transport).get(), nullptr),
                   fmt::format("a participant in domain {}", transport.domain)) {}

static_assert(10 + 2 * (kMostParticipants - 1) + 1 < 250, "the last index stays below the next domain's ports");

namespace detail {
namespace {

constexpr int kPlaybackDepth = 64;
constexpr int kFrameDepth = 8;  // federates are at most 4 ticks apart: core/federation/schedule.hpp

Qos make_qos(const Channel& channel) {
  Qos qos(dds_create_qos());
  dds_qset_reliability(qos.get(), DDS_RELIABILITY_RELIABLE, DDS_SECS(10));
  switch (channel.delivery) {
    case Delivery::kFrame: dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, kFrameDepth); break;
    case Delivery::kMembership:
      dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, 1);
      dds_qset_durability(qos.get(), DDS_DURABILITY_TRANSIENT_LOCAL);
      // When one writer leaves, others of the same key keep their instance.
      dds_qset_writer_data_lifecycle(qos.get(), false);
      break;
    case Delivery::kLog:
      dds_qset_history(qos.get(), DDS_HISTORY_KEEP_ALL, 0);
      dds_qset_durability(qos.get(), DDS_DURABILITY_TRANSIENT_LOCAL);
      dds_qset_durability_service(qos.get(), 0, DDS_HISTORY_KEEP_LAST, 1, DDS_LENGTH_UNLIMITED,
                                  DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
      break;
    case Delivery::kStatus:
      dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, 1);
      dds_qset_durability(qos.get(), DDS_DURABILITY_TRANSIENT_LOCAL);
      break;
    case Delivery::kRequest: dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, 16); break;
    case Delivery::kTelemetry:
      dds_qset_reliability(qos.get(), DDS_RELIABILITY_BEST_EFFORT, 0);
      dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, 1);
      break;
    case Delivery::kNode:
      dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, 10);
      dds_qset_writer_data_lifecycle(qos.get(), false);
      break;
    case Delivery::kSensor:
      dds_qset_reliability(qos.get(), DDS_RELIABILITY_BEST_EFFORT, 0);
      dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, 16);
      break;
    case Delivery::kPlayback:
      dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, kPlaybackDepth);
      dds_qset_durability(qos.get(), DDS_DURABILITY_TRANSIENT_LOCAL);
      // Depth of what readers get that match later than the writer believes.
      dds_qset_durability_service(qos.get(), 0, DDS_HISTORY_KEEP_LAST, kPlaybackDepth, DDS_LENGTH_UNLIMITED,
                                  DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
      dds_qset_writer_data_lifecycle(qos.get(), false);
      break;
  }
  return qos;
}

// All definitions of a topic must have the same QoS, so the partition is set on the endpoint only.
Entity make_topic(const Participant& participant, const Channel& channel, const dds_topic_descriptor_t* type) {
  return {dds_create_topic(participant.get(), type, channel.topic.c_str(), nullptr, nullptr),
          "topic " + channel.topic};
}

Qos endpoint_qos(const Channel& channel) {
  Qos qos = make_qos(channel);
  if (!channel.partition.empty()) dds_qset_partition1(qos.get(), channel.partition.c_str());
  if (!channel.user_data.empty()) dds_qset_userdata(qos.get(), channel.user_data.data(), channel.user_data.size());
  return qos;
}

}  // namespace

Endpoint make_writer(const Participant& participant, const Channel& channel, const dds_topic_descriptor_t* type) {
  Endpoint result;
  result.topic = make_topic(participant, channel, type);
  result.endpoint =
      Entity(dds_create_writer(participant.get(), result.topic.get(), endpoint_qos(channel).get(), nullptr),
             "a writer of " + channel.topic);
  return result;
}

Endpoint make_reader(const Participant& participant, const Channel& channel, const dds_topic_descriptor_t* type,
                     const dds_listener_t* listener) {
  Endpoint result;
  result.topic = make_topic(participant, channel, type);
  result.endpoint =
      Entity(dds_create_reader(participant.get(), result.topic.get(), endpoint_qos(channel).get(), listener),
             "a reader of " + channel.topic);
  return result;
}

void write(dds_entity_t writer, const void* sample) {
  if (const dds_return_t code = dds_write(writer, sample); code != DDS_RETCODE_OK) {
    throw RunError(fmt::format("DDS: a sample could not be written: {}", dds_strretcode(code)));
  }
}

void take_all(dds_entity_t reader, void* context, void (*each)(void*, const void*, const dds_sample_info_t&)) {
  constexpr int kBatch = 16;
  void* samples[kBatch] = {};
  dds_sample_info_t infos[kBatch];
  for (;;) {
    samples[0] = nullptr;
    const dds_return_t count = dds_take(reader, samples, infos, kBatch, kBatch);
    if (count <= 0) return;
    for (int i = 0; i < count; ++i) each(context, samples[i], infos[i]);
    dds_return_loan(reader, samples, count);
    if (count < kBatch) return;
  }
}

}  // namespace detail
}  // namespace kilotwin::dds
