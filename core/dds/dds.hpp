/// RAII wrapper of the Cyclone DDS C API: a participant, typed writers and readers, and the QoS profiles of the project.
/// Errors are RunErrors with Cyclone's own text.
#pragma once

#include <dds/dds.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace kilotwin::dds {

/// How a participant reaches other participants.
struct Transport {
  std::uint32_t domain = 0;
  /// Addresses of all machines of the run, including this one. Empty: all processes are on this machine, and all traffic
  /// uses the loopback interface.
  std::vector<std::string> peers;
  /// The whole configuration, as CYCLONEDDS_URI has it, in place of what `peers` makes. Empty: what `peers` makes.
  std::string configuration = {};
  /// USER_DATA of the participant, which other participants receive.
  std::string user_data = {};
};

/// Highest domain whose UDP ports (7400 + 250 domain + ...) exist.
inline constexpr std::uint32_t kLastDomain = 230;
/// Largest number of participants of one domain on one machine. Index i listens at UDP ports 7400 + 250 domain + 10 + 2i and
/// + 11 + 2i (RTPS 9.6.1.1). The ports of index 120 would belong to the next domain.
inline constexpr std::uint32_t kMostParticipants = 120;
/// Largest number of services of a run on one machine. The rest is for the launcher and for clients.
inline constexpr std::uint32_t kMostServices = kMostParticipants - 10;
/// Silence after which a federate counts as lost, s; crowded machines get longer.
inline constexpr double kSilence_s = 2.0;
/// Silence after which DDS removes a process, s. It is longer than the slowest start. Members of a run are detected sooner
/// (core/federation/session.hpp).
inline constexpr double kLease_s = 30.0;
/// Interval at which a participant announces itself, s.
inline constexpr double kAnnounceEvery_s = 2.0;

/// Cyclone's configuration for this transport, as XML.
[[nodiscard]] std::string cyclone_configuration(const Transport&);

/// QoS profiles: reliability, history and durability.
enum class Delivery {
  kFrame,       ///< reliable, keep-last 8 per publisher, volatile: tick topics
  kMembership,  ///< reliable, keep-last 1, transient-local: members. An instance lives while any writer of it does
  kLog,         ///< reliable, keep-all: readers get all samples from their match on, and before these the last one
  kStatus,      ///< reliable, keep-last 1, transient-local
  kRequest,     ///< reliable, keep-last 16, volatile: requests of outsiders
  kTelemetry,   ///< best effort, keep-last 1, volatile
  kNode,        ///< reliable, keep-last 10, volatile; a writer that ends disposes nothing: as nodes of ROS 2 write
  kSensor,      ///< best effort, keep-last 16, volatile: sensor frames; a late frame is worth less than the next
  kPlayback,    ///< reliable, keep-last 64, transient-local: what is played or heard once and must not be lost
};

/// An entity handle that deletes its entity.
class Entity {
 public:
  Entity() = default;
  /// Throws RunError if `handle` is an error code; `what` names the entity in the message.
  Entity(dds_entity_t handle, const std::string& what);
  Entity(Entity&& other) noexcept : handle_(std::exchange(other.handle_, 0)) {}
  Entity& operator=(Entity&& other) noexcept;
  ~Entity();
  [[nodiscard]] dds_entity_t get() const { return handle_; }

 private:
  dds_entity_t handle_ = 0;
};

/// Cyclone has a domain once per process, with one configuration. Participants share it; the last one deletes it.
class Domain {
 public:
  explicit Domain(const Transport&);
  ~Domain();
  Domain(const Domain&) = delete;

 private:
  std::uint32_t id_;
};

class Participant {
 public:
  /// If the process has a participant in the domain already, that participant's peers apply.
  explicit Participant(const Transport&);
  [[nodiscard]] dds_entity_t get() const { return participant_.get(); }

 private:
  Domain domain_;
  Entity participant_;
};

/// A topic, its delivery, and the DDS partition that routes it ("" = the default one).
struct Channel {
  std::string topic;
  Delivery delivery;
  std::string partition;
  /// USER_DATA of the endpoint.
  std::string user_data = {};
};

namespace detail {
struct Endpoint {
  Entity topic, endpoint;
};
Endpoint make_writer(const Participant&, const Channel&, const dds_topic_descriptor_t*);
Endpoint make_reader(const Participant&, const Channel&, const dds_topic_descriptor_t*, const dds_listener_t*);
void write(dds_entity_t writer, const void* sample);
/// Takes all samples and passes each on: a valid one, or, for a disposed instance, its key alone.
void take_all(dds_entity_t reader, void* context,
              void (*each)(void* context, const void* sample, const dds_sample_info_t&));
}  // namespace detail

/// The descriptor that idlc generates for T; specialised in core/federation/topics.hpp.
template <class T> const dds_topic_descriptor_t* descriptor();

template <class T> class Writer {
 public:
  Writer(const Participant& participant, const Channel& channel)
      : endpoint_(detail::make_writer(participant, channel, descriptor<T>())) {}
  void write(const T& sample) { detail::write(endpoint_.endpoint.get(), &sample); }
  /// Number of currently matched readers.
  [[nodiscard]] std::uint32_t readers() const {
    dds_publication_matched_status_t status{};
    dds_get_publication_matched_status(endpoint_.endpoint.get(), &status);
    return status.current_count;
  }
  /// Waits until every matched reader has acknowledged all samples. Returns false after `seconds`.
  bool flush(double seconds) const {
    return dds_wait_for_acks(endpoint_.endpoint.get(), static_cast<dds_duration_t>(seconds * 1e9)) ==
           DDS_RETCODE_OK;
  }

 private:
  detail::Endpoint endpoint_;
};

/// State of a sample at its reader.
struct SampleState {
  bool valid;  ///< all fields are set; otherwise only the key fields
  bool alive;  ///< the instance has a living writer
};

/// Calls back on Cyclone's receive thread for every sample. The callback must be short and must not throw.
template <class T> class Reader {
 public:
  using Callback = std::function<void(const T& sample, SampleState state)>;

  Reader(const Participant& participant, const Channel& channel, Callback callback)
      : receiver_(std::make_unique<Receiver>(std::move(callback))) {
    const std::unique_ptr<dds_listener_t, void (*)(dds_listener_t*)> listener(dds_create_listener(receiver_.get()),
                                                                              dds_delete_listener);
    dds_lset_data_available(listener.get(), [](dds_entity_t reader, void* receiver) { take(reader, receiver); });
    receiver_->turn.store(0, std::memory_order_release);
    endpoint_ = detail::make_reader(participant, channel, descriptor<T>(), listener.get());
  }
  Reader(const Reader&) = delete;
  /// Returns after the last callback has returned.
  ~Reader() {
    endpoint_ = {};
    static_cast<void>(receiver_->turn.load(std::memory_order_acquire));
  }

 private:
  struct Receiver {
    explicit Receiver(Callback given) : callback(std::move(given)) {}
    const Callback callback;
    /// Orders construction, callbacks and destruction. Cyclone's locks do so too, but race detectors do not see
    /// them.
    std::atomic<std::uint64_t> turn{0};
  };

  static void take(dds_entity_t reader, void* context) {
    auto& receiver = *static_cast<Receiver*>(context);
    static_cast<void>(receiver.turn.load(std::memory_order_acquire));
    detail::take_all(reader, context, [](void* to, const void* sample, const dds_sample_info_t& info) {
      static_cast<Receiver*>(to)->callback(
          *static_cast<const T*>(sample),
          SampleState{info.valid_data, info.instance_state == DDS_ALIVE_INSTANCE_STATE});
    });
    receiver.turn.fetch_add(1, std::memory_order_release);
  }

  std::unique_ptr<Receiver> receiver_;
  detail::Endpoint endpoint_;
};

/// Whether all participant indices of the domain are taken on this machine.
[[nodiscard]] bool domain_is_full(std::uint32_t domain);

/// Claims a domain that no process on this machine uses. The claim ends with the process, however it ends. Throws UserError
/// if `wanted` is in use, RunError if all domains are.
class DomainClaim {
 public:
  static DomainClaim any();
  static DomainClaim exactly(std::uint32_t wanted);
  [[nodiscard]] std::uint32_t domain() const { return domain_; }
  DomainClaim(DomainClaim&& other) noexcept : domain_(other.domain_), socket_(std::exchange(other.socket_, -1)) {}
  ~DomainClaim();

 private:
  DomainClaim(std::uint32_t domain, int socket) : domain_(domain), socket_(socket) {}
  std::uint32_t domain_;
  int socket_;
};

}  // namespace kilotwin::dds
