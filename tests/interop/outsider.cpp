// Joins a run of tests/interop/outsider.txtpb with eProsima Fast DDS. Of Kilotwin it has idl/public.idl alone: names of
// topics and QoS are those of docs/how-to/join.md, written down once more.
// Usage: outsider DOMAIN. Prints a line for each thing proven.
// Exit status 0: all were; 1: one was not; 2: bad arguments.
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>

#include "publicPubSubTypes.h"

namespace {

namespace fast = eprosima::fastdds::dds;
namespace rtps = eprosima::fastdds::rtps;
using eprosima::fastrtps::types::ReturnCode_t;
using namespace kilotwin::open;
using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr std::uint32_t kSimulatedRobots = 6;  // as in outsider.txtpb
constexpr std::uint32_t kTrackedRobot = 6;
constexpr std::uint32_t kRobots = 7;
/// Kilotwin's participants listen on the ports of the indices 0 to 120 of the domain.
constexpr std::uint32_t kIndices = 121;
constexpr char kClient[] = "fast dds";

/// The entity that a factory of Fast DDS made. Throws an exception that names it if there is none.
template <class T> T* made(T* entity, const std::string& what) {
  if (entity == nullptr) throw std::runtime_error("Fast DDS cannot make " + what);
  return entity;
}

/// Unicast on the loopback interface, as services on one machine do: `lo` has no multicast.
fast::DomainParticipantQos loopback_only() {
  fast::DomainParticipantQos qos = fast::PARTICIPANT_QOS_DEFAULT;
  qos.name(kClient);
  const auto transport = std::make_shared<rtps::UDPv4TransportDescriptor>();
  transport->interfaceWhiteList.emplace_back("127.0.0.1");
  transport->maxInitialPeersRange = kIndices;
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(transport);
  eprosima::fastrtps::rtps::Locator_t loopback;  // port 0: the ports that belong to domain and index
  eprosima::fastrtps::rtps::IPLocator::setIPv4(loopback, 127, 0, 0, 1);
  auto& builtin = qos.wire_protocol().builtin;
  builtin.metatrafficUnicastLocatorList.push_back(loopback);  // else it would listen for multicast, too
  builtin.initialPeersList.push_back(loopback);
  return qos;
}

/// A participant and all that hangs on it.
class Participant {
 public:
  explicit Participant(std::uint32_t domain)
      : participant_(made(factory().create_participant(domain, loopback_only()),
                          "a participant in domain " + std::to_string(domain))),
        publisher_(made(participant_->create_publisher(fast::PUBLISHER_QOS_DEFAULT), "a publisher")),
        subscriber_(made(participant_->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT), "a subscriber")) {}
  Participant(const Participant&) = delete;
  ~Participant() {
    participant_->delete_contained_entities();
    factory().delete_participant(participant_);
  }

  template <class PubSubType> fast::DataWriter* writer(const std::string& name) {
    fast::DataWriterQos qos = fast::DATAWRITER_QOS_DEFAULT;
    qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
    qos.history().kind = fast::KEEP_LAST_HISTORY_QOS;
    qos.history().depth = 16;
    qos.durability().kind = fast::VOLATILE_DURABILITY_QOS;
    return made(publisher_->create_datawriter(topic<PubSubType>(name), qos), "a writer of " + name);
  }

  /// The last sample of each instance is kept.
  template <class PubSubType>
  fast::DataReader* reader(const std::string& name, fast::ReliabilityQosPolicyKind reliability,
                           fast::DurabilityQosPolicyKind durability) {
    fast::DataReaderQos qos = fast::DATAREADER_QOS_DEFAULT;
    qos.reliability().kind = reliability;
    qos.durability().kind = durability;
    qos.history().kind = fast::KEEP_LAST_HISTORY_QOS;
    qos.history().depth = 1;
    return made(subscriber_->create_datareader(topic<PubSubType>(name), qos), "a reader of " + name);
  }

 private:
  static fast::DomainParticipantFactory& factory() { return *fast::DomainParticipantFactory::get_instance(); }

  template <class PubSubType> fast::Topic* topic(const std::string& name) {
    const fast::TypeSupport type(new PubSubType);
    if (type.register_type(participant_) != ReturnCode_t::RETCODE_OK)
      throw std::runtime_error("Fast DDS cannot register the type of " + name);
    return made(participant_->create_topic(name, type.get_type_name(), fast::TOPIC_QOS_DEFAULT), "topic " + name);
  }

  fast::DomainParticipant* participant_;
  fast::Publisher* publisher_;
  fast::Subscriber* subscriber_;
};

/// A run as an outsider sees and steers it.
class Outsider {
 public:
  explicit Outsider(std::uint32_t domain)
      : participant_(domain),
        control_(participant_.writer<RunControlPubSubType>("kilotwin/run_control")),
        overhead_(participant_.writer<OverheadPacketPubSubType>("kilotwin/overhead_packets")),
        tracker_(participant_.writer<TrackerFramePubSubType>("kilotwin/tracker_frames")),
        status_reader_(participant_.reader<RunStatusPubSubType>(
            "kilotwin/run_status", fast::RELIABLE_RELIABILITY_QOS, fast::TRANSIENT_LOCAL_DURABILITY_QOS)),
        robots_reader_(participant_.reader<RobotStatePubSubType>(
            "kilotwin/robots", fast::BEST_EFFORT_RELIABILITY_QOS, fast::VOLATILE_DURABILITY_QOS)) {}

  void watch() {
    await("kilotwin/run_status to say that the run is RUNNING", 60s, [this] { return status_.phase() == RUNNING; });
    proven("reads kilotwin/run_status: run %016llx, \"%s\", %u robots, tick %lld of %lld",
           static_cast<unsigned long long>(status_.run()), status_.name().c_str(), status_.robots(),
           static_cast<long long>(status_.tick()), static_cast<long long>(status_.last_tick()));
    demand(status_.robots() == kRobots && status_.run() != 0 && status_.note().size() == 0,
           "the status is not that of outsider.txtpb");

    await("kilotwin/robots to show every robot", 10s, [this] { return robots_.size() == kRobots; });
    const RobotState& real = robots_.at(kTrackedRobot);
    demand(real.run() == status_.run() && real.x_mm() == 300 && real.y_mm() == 300 && real.heading_rad() == 0 &&
               real.led() == 0,
           "the tracked robot does not stand where the experiment puts it");
    proven("reads kilotwin/robots: all %u, robot %u at (%g, %g) mm", kRobots, kTrackedRobot, real.x_mm(),
           real.y_mm());
  }

  void pause_and_step() {
    ask(PAUSE_RUN, 0, "PAUSED", [this] { return status_.phase() == PAUSED; });
    const std::int64_t at = stands_still();
    proven("PAUSE: the run stands at tick %lld", static_cast<long long>(at));

    constexpr std::uint32_t kSteps = 5;
    ask(STEP_RUN, kSteps, "PAUSED five ticks on",
        [&] { return status_.phase() == PAUSED && status_.tick() >= at + kSteps; });
    const std::int64_t then = stands_still();
    demand(then == at + kSteps, "after STEP 5 the run stands at tick " + std::to_string(then) + " instead of " +
                                    std::to_string(at + kSteps));
    proven("STEP 5, said %d times: the run stands at tick %lld", repetitions_, static_cast<long long>(then));

    ask(CONTINUE_RUN, 0, "RUNNING, and ten ticks on",
        [&] { return status_.phase() == RUNNING && status_.tick() > then + 10; });
    proven("CONTINUE: the run has come to tick %lld", static_cast<long long>(status_.tick()));
  }

  void speak_from_above() {
    for (const std::uint8_t led : {std::uint8_t{0x03}, std::uint8_t{0x30}}) {  // red, blue
      OverheadPacket packet;
      packet.client(kClient);
      packet.request(++request_);
      packet.command(2);
      packet.message()[0] = led;
      packet.message()[9] = 0x42;
      await(
          "every simulated robot to show the colour of the overhead packet", 20s,
          [&] {
            return std::all_of(robots_.begin(), robots_.end(), [&](const auto& entry) {
              return entry.first >= kSimulatedRobots || entry.second.led() == led;
            });
          },
          [&] { write(overhead_, packet); });
    }
    proven("publishes kilotwin/overhead_packets: all %u simulated robots turn red, then blue", kSimulatedRobots);
  }

  void track() {
    struct Place {
      double x_mm, y_mm, heading_rad;
    };
    const Place places[] = {{-201.1, 123.7, 0.3}, {250 / 3.0, -311.9, -2.9}};
    std::uint64_t number = 0;
    for (const Place& place : places) {
      const auto is_there = [&] {
        const RobotState& robot = robots_.at(kTrackedRobot);
        return std::abs(robot.x_mm() - place.x_mm) < 1 && std::abs(robot.y_mm() - place.y_mm) < 1 &&
               std::abs(robot.heading_rad() - place.heading_rad) < 0.05;
      };
      const auto see = [&] {
        const auto now = std::chrono::steady_clock::now().time_since_epoch();
        TrackerFrame frame;
        frame.source("outsider");
        frame.frame(++number);
        frame.capture_ns(std::chrono::duration_cast<std::chrono::nanoseconds>(now).count());
        frame.sent_ns(frame.capture_ns());
        frame.robot({kTrackedRobot});
        frame.state({0});
        frame.x_mm({place.x_mm});
        frame.y_mm({place.y_mm});
        frame.heading_rad({place.heading_rad});
        frame.xx_mm2({0.04f});
        frame.xy_mm2({0.0f});
        frame.yy_mm2({0.04f});
        frame.heading_variance_rad2({0.0004f});
        frame.led({255});
        write(tracker_, frame);
      };
      await("the tracked robot to be where the tracker sees it", 10s, is_there, see);
      proven("publishes kilotwin/tracker_frames: robot %u is at (%.1f, %.1f) mm", kTrackedRobot,
             robots_.at(kTrackedRobot).x_mm(), robots_.at(kTrackedRobot).y_mm());
    }
  }

  void stop() {
    ask(STOP_RUN, 0, "ENDED", [this] { return status_.phase() == ENDED; });
    proven("STOP: the run has ended at tick %lld", static_cast<long long>(status_.tick()));
  }

 private:
  using Condition = std::function<bool()>;

  static void demand(bool condition, const std::string& otherwise) {
    if (!condition) throw std::runtime_error(otherwise);
  }

  template <class... Arguments> static void proven(const char* format, Arguments... arguments) {
    std::printf(format, arguments...);
    std::printf("\n");
    std::fflush(stdout);
  }

  /// Reads until the condition holds, and calls `meanwhile` five times a second. A writer may see a reader before the
  /// reader sees it, and what is sent in between is lost; so an outsider says a thing until it sees the effect.
  void await(
      const std::string& what, Clock::duration patience, const Condition& holds,
      const std::function<void()>& meanwhile = [] {}) {
    const auto begun = Clock::now();
    auto next = begun;
    for (;;) {
      read();
      if (holds()) return;
      const auto now = Clock::now();
      demand(now - begun < patience, "waited in vain for " + what + "; the last status: " + describe_status());
      if (now >= next) {
        meanwhile();
        next = now + 200ms;
      }
      std::this_thread::sleep_for(5ms);
    }
  }

  /// Asks for a thing until it is seen, and once more: a repeated request counts once.
  void ask(RunCommand command, std::uint32_t steps, const std::string& awaited, const Condition& holds) {
    RunControl request;
    request.client(kClient);
    request.request(++request_);
    request.command(command);
    request.steps(steps);
    repetitions_ = 0;
    const auto say = [&] {
      write(control_, request);
      ++repetitions_;
    };
    await("kilotwin/run_status to say " + awaited, 20s, holds, say);
    say();
  }

  /// The tick of a paused run, which must be the same in every status of one second.
  std::int64_t stands_still() {
    const std::int64_t at = status_.tick();
    const int before = statuses_;
    const auto until = Clock::now() + 1s;
    await("a second to pass", 2s, [&] {
      demand(status_.phase() == PAUSED && status_.tick() == at, "the paused run goes on: " + describe_status());
      return Clock::now() >= until;
    });
    demand(statuses_ - before >= 2, "a paused run says nothing on kilotwin/run_status");
    return at;
  }

  static void write(fast::DataWriter* writer, auto& sample) {
    if (!writer->write(&sample))
      throw std::runtime_error("Fast DDS cannot write a sample of " + writer->get_topic()->get_name());
  }

  void read() {
    fast::SampleInfo info;
    for (RunStatus status; status_reader_->take_next_sample(&status, &info) == ReturnCode_t::RETCODE_OK;) {
      if (!info.valid_data) continue;
      status_ = status;
      ++statuses_;
    }
    for (RobotState state; robots_reader_->take_next_sample(&state, &info) == ReturnCode_t::RETCODE_OK;) {
      if (info.valid_data) robots_[state.robot()] = state;
    }
  }

  [[nodiscard]] std::string describe_status() {
    if (statuses_ == 0) return "none";
    static constexpr const char* kPhases[] = {"STARTING", "RUNNING", "PAUSED", "ENDED", "BROKEN"};
    const auto phase = static_cast<std::uint32_t>(status_.phase());
    return std::string(phase < std::size(kPhases) ? kPhases[phase] : "an unknown phase") + " at tick " +
           std::to_string(status_.tick()) + " " + status_.note().c_str();
  }

  Participant participant_;
  fast::DataWriter* control_;
  fast::DataWriter* overhead_;
  fast::DataWriter* tracker_;
  fast::DataReader* status_reader_;
  fast::DataReader* robots_reader_;
  RunStatus status_;
  int statuses_ = 0;
  std::map<std::uint32_t, RobotState> robots_;
  std::uint32_t request_ = 0;
  int repetitions_ = 0;
};

}  // namespace

int main(int count, char** words) {
  std::uint32_t domain = 0;
  const char* end = count == 2 ? words[1] + std::strlen(words[1]) : nullptr;
  if (count != 2 || std::from_chars(words[1], end, domain).ptr != end || domain > 230) {
    std::fprintf(stderr, "usage: outsider DOMAIN, 0 to 230\n");
    return 2;
  }
  try {
    Outsider outsider(domain);
    outsider.watch();
    outsider.pause_and_step();
    outsider.speak_from_above();
    outsider.track();
    outsider.stop();
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "outsider: %s\n", error.what());
    return 1;
  }
}
