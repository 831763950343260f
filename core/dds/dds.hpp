/// RAII over the Cyclone DDS C API: a participant, typed writers and readers, and the few QoS profiles that the project
/// uses. Errors are RunError with Cyclone's own words.
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

/// How a participant reaches others.
struct Transport {
  std::uint32_t domain = 0;
  /// Addresses of the machines that take part, this one included. Empty: everybody is on this machine, and all traffic
  /// stays on the loopback interface.
  std::vector<std::string> peers;
};

/// Highest domain whose UDP ports (7400 + 250 domain + ...) exist.
inline constexpr std::uint32_t kLastDomain = 230;
/// Participants of one domain on one machine, at most. Index i listens at UDP ports 7400 + 250 domain + 10 + 2i and + 11 + 2i
/// (RTPS 9.6.1.1): those of index 120 would be the next domain's.
inline constexpr std::uint32_t kMostParticipants = 120;
/// Services of a run on one machine, at most: the launcher and some that watch or steer take part as well.
inline constexpr std::uint32_t kMostServices = kMostParticipants - 10;
/// For how long a federate may be silent until the others take it for lost, s; longer on crowded machines.
inline constexpr double kSilence_s = 2.0;
/// For how long a process may be silent until DDS forgets it, s. Longer than the busiest start; who takes part in a run is
/// known sooner (core/federation/session.hpp).
inline constexpr double kLease_s = 30.0;
/// How often a participant tells others that it is there, s.
inline constexpr double kAnnounceEvery_s = 2.0;

/// The configuration that the transport gives Cyclone, as XML.
[[nodiscard]] std::string cyclone_configuration(const Transport&);

/// Who may hear what, for how long.
enum class Delivery {
  kFrame,       ///< reliable, keep-last 8 per publisher, volatile: tick topics
  kMembership,  ///< reliable, keep-last 1, transient-local: who is here. An instance lives while any writer does
  kMetrics,     ///< reliable, keep-all; of what was read, late readers get the last sample
  kLog,         ///< reliable, keep-all, transient-local: late readers get everything
  kStatus,      ///< reliable, keep-last 1, transient-local
  kRequest,     ///< reliable, keep-last 16, volatile: what outsiders ask
  kTelemetry,   ///< best effort, keep-last 1, volatile
  kSensor,  ///< best effort, keep-last 16, volatile: frames of sensors; a late frame is worth less than the next
};

/// An entity handle that deletes what it names.
class Entity {
 public:
  Entity() = default;
  /// `what` says in an error what could not be made.
  Entity(dds_entity_t handle, const std::string& what);
  Entity(Entity&& other) noexcept : handle_(std::exchange(other.handle_, 0)) {}
  Entity& operator=(Entity&& other) noexcept;
  ~Entity();
  [[nodiscard]] dds_entity_t get() const { return handle_; }

 private:
  dds_entity_t handle_ = 0;
};

/// Cyclone knows a domain once per process, with one configuration: participants share it, and the last one ends it.
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
  /// Where the process has a participant in the domain already, that one's peers count.
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
};

namespace detail {
struct Endpoint {
  Entity topic, endpoint;
};
Endpoint make_writer(const Participant&, const Channel&, const dds_topic_descriptor_t*);
Endpoint make_reader(const Participant&, const Channel&, const dds_topic_descriptor_t*, const dds_listener_t*);
void write(dds_entity_t writer, const void* sample);
/// Takes what there is and hands over every sample (valid or, where an instance went away, its key alone).
void take_all(dds_entity_t reader, void* context,
              void (*each)(void* context, const void* sample, const dds_sample_info_t&));
}  // namespace detail

/// The descriptor that idlc made for T; specialised in core/federation/topics.hpp.
template <class T> const dds_topic_descriptor_t* descriptor();

template <class T> class Writer {
 public:
  Writer(const Participant& participant, const Channel& channel)
      : endpoint_(detail::make_writer(participant, channel, descriptor<T>())) {}
  void write(const T& sample) { detail::write(endpoint_.endpoint.get(), &sample); }
  /// How many readers are matched at the moment.
  [[nodiscard]] std::uint32_t readers() const {
    dds_publication_matched_status_t status{};
    dds_get_publication_matched_status(endpoint_.endpoint.get(), &status);
    return status.current_count;
  }
  /// Waits until every matched reader has got everything, or `seconds` have passed.
  bool flush(double seconds) const {
    return dds_wait_for_acks(endpoint_.endpoint.get(), static_cast<dds_duration_t>(seconds * 1e9)) ==
           DDS_RETCODE_OK;
  }

 private:
  detail::Endpoint endpoint_;
};

/// What a reader is told besides the sample.
struct SampleState {
  bool valid;  ///< all fields are set; else only the key fields
  bool alive;  ///< the instance has a writer that lives
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
  /// Returns when the last callback has returned.
  ~Reader() {
    endpoint_ = {};
    static_cast<void>(receiver_->turn.load(std::memory_order_acquire));
  }

 private:
  struct Receiver {
    explicit Receiver(Callback given) : callback(std::move(given)) {}
    const Callback callback;
    /// Orders construction, callbacks and destruction. Cyclone's own locks do so too, but a checker of races cannot look
    /// into them.
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

/// Whether every participant index of the domain is taken on this machine.
[[nodiscard]] bool domain_is_full(std::uint32_t domain);

/// Picks a domain that nobody on this machine uses and keeps it for this process; freed when the process ends, however it
/// ends. Throws UserError where `wanted` is in use, RunError where all are.
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
