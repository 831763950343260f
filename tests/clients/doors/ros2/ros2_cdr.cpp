// Serialises and deserialises ROS messages as the door does: by Cyclone DDS, with the types of idl/ros2.idl.
// Usage: ros2_cdr < REQUESTS > ANSWERS. Both are sequences of blocks: a length of 4 octets, least first, then the octets.
//   request: first octet the type ('S' PoseStamped, 'V' PoseWithCovarianceStamped, 'A' PoseArray, 'T' TFMessage,
//            'N' NamedPoseArray, 'R' RigidBodies, 'C' Clock), then a message as on the wire. Two answers: the message serialised
//            again, and what the door reads of it, as text: a line per header, then a line per pose.
//   request 'P': one answer, a PoseArray that the door would publish.
#include <dds/dds.h>
#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/ddsi_sertype.h>
#include <fmt/format.h>

#include <array>
#include <cstdio>
#include <memory>
#include <optional>
#include <stdexcept>
#include <vector>

#include "clients/doors/ros2/messages.hpp"

namespace {

using namespace kilotwin;
using namespace kilotwin::doors;
using Octets = std::vector<std::uint8_t>;

std::optional<Octets> next_request() {
  std::array<std::uint8_t, 4> length{};
  if (std::fread(length.data(), 1, length.size(), stdin) != length.size()) return std::nullopt;
  Octets request(length[0] | static_cast<std::uint32_t>(length[1]) << 8 |
                 static_cast<std::uint32_t>(length[2]) << 16 | static_cast<std::uint32_t>(length[3]) << 24);
  if (std::fread(request.data(), 1, request.size(), stdin) != request.size()) return std::nullopt;
  return request;
}

void answer(const void* octets, std::size_t length) {
  const auto part = [&](int shift) { return static_cast<std::uint8_t>(length >> shift); };
  const std::array<std::uint8_t, 4> head{part(0), part(8), part(16), part(24)};
  std::fwrite(head.data(), 1, head.size(), stdout);
  std::fwrite(octets, 1, length, stdout);
}

/// Cyclone's own code for a type.
template <class T> class Serialiser {
 public:
  explicit Serialiser(const dds::Participant& participant)
      : topic_(dds_create_topic(participant.get(), dds::descriptor<T>(), ros2::type_hash<T>(), nullptr, nullptr),
               "a topic"),
        writer_(dds_create_writer(participant.get(), topic_.get(), nullptr, nullptr), "a writer"),
        reader_(dds_create_reader(participant.get(), topic_.get(), reliable().get(), nullptr), "a reader") {
    // A sample that was written and read knows its type.
    const T empty{};
    dds_sample_info_t info{};
    if (dds_write(writer_.get(), &empty) != DDS_RETCODE_OK ||
        dds_takecdr(reader_.get(), &first_, 1, &info, DDS_ANY_STATE) != 1)
      throw std::runtime_error("Cyclone lost a sample");
    type_ = first_->type;
  }
  Serialiser(const Serialiser&) = delete;
  ~Serialiser() { ddsi_serdata_unref(first_); }
  void write(const T& sample) const {
    ddsi_serdata* const data = ddsi_serdata_from_sample(type_, SDK_DATA, &sample);
    Octets octets(ddsi_serdata_size(data));
    ddsi_serdata_to_ser(data, 0, octets.size(), octets.data());
    ddsi_serdata_unref(data);
    // The last octets of a message may be padding to a multiple of four, which its header counts.
    octets.resize(octets.size() - (octets[3] & 3));
    octets[3] = 0;
    answer(octets.data(), octets.size());
  }
  void again(const Octets& request) const {
    ddsrt_iovec_t part{const_cast<std::uint8_t*>(request.data() + 1), request.size() - 1};
    ddsi_serdata* const data = ddsi_serdata_from_ser_iov(type_, SDK_DATA, 1, &part, part.iov_len);
    if (data == nullptr) throw std::runtime_error("Cyclone refuses the message");
    T sample{};
    ddsi_serdata_to_sample(data, &sample, nullptr, nullptr);
    ddsi_serdata_unref(data);
    write(sample);
    tell(sample);
    dds_sample_free(&sample, dds::descriptor<T>(), DDS_FREE_CONTENTS);
  }

 private:
  static void tell(const T& sample) {
    std::string text;
    if constexpr (std::is_same_v<T, ros2::Clock>) {
      text = fmt::format("{} {}\n", sample.clock.sec, sample.clock.nanosec);
    } else {
      for (const ros2::Message& message : ros2::read(sample, "topic")) {
        text += fmt::format("header {} {} {}\n", message.stamp_ns.value_or(-1), message.frame_id,
                            message.frame_number ? std::to_string(*message.frame_number) : "-");
        for (const ros2::NamedPose& named : message.poses) {
          const SourcePose& p = named.pose;
          text +=
              fmt::format("pose {} {} {} {} {} {} {} {}", named.number ? std::to_string(*named.number) : named.name,
                          p.x, p.y, p.z, p.qx, p.qy, p.qz, p.qw);
          if (const auto& c = named.covariance)
            text += fmt::format(" {} {} {} {} {} {} {}", c->xx, c->xy, c->xz, c->yy, c->zz, c->about_y, c->about_z);
          text += "\n";
        }
      }
    }
    answer(text.data(), text.size());
  }

  static std::unique_ptr<dds_qos_t, void (*)(dds_qos_t*)> reliable() {
    std::unique_ptr<dds_qos_t, void (*)(dds_qos_t*)> qos(dds_create_qos(), dds_delete_qos);
    dds_qset_reliability(qos.get(), DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
    return qos;
  }

  dds::Entity topic_, writer_, reader_;
  ddsi_serdata* first_ = nullptr;
  const ddsi_sertype* type_ = nullptr;
};

void publish(const Serialiser<ros2::PoseArray>& serialiser) {
  std::string frame_id = "map";
  std::array poses{ros2::pose_of({1, 2, 3, 4, 5, 6, 7}), ros2::pose_of({-0.5, 0, 0, 0, 0, 0, 1})};
  ros2::PoseArray sample{};
  sample.header.stamp = ros2::time_of(12'000'000'034);
  sample.header.frame_id = frame_id.data();
  sample.poses = {2, 2, poses.data(), false};
  serialiser.write(sample);
}

struct Serialisers {
  explicit Serialisers(const dds::Participant& p)
      : stamped(p), covariance(p), array(p), tf(p), named(p), bodies(p), clock(p) {}
  void serve(const Octets& request) const {
    switch (request.at(0)) {
      case 'S': return stamped.again(request);
      case 'V': return covariance.again(request);
      case 'A': return array.again(request);
      case 'T': return tf.again(request);
      case 'N': return named.again(request);
      case 'R': return bodies.again(request);
      case 'C': return clock.again(request);
      case 'P': return publish(array);
      default: throw std::runtime_error("unknown request");
    }
  }
  Serialiser<ros2::PoseStamped> stamped;
  Serialiser<ros2::PoseWithCovarianceStamped> covariance;
  Serialiser<ros2::PoseArray> array;
  Serialiser<ros2::TFMessage> tf;
  Serialiser<ros2::NamedPoseArray> named;
  Serialiser<ros2::RigidBodies> bodies;
  Serialiser<ros2::Clock> clock;
};

}  // namespace

int main() {
  try {
    const dds::DomainClaim claim = dds::DomainClaim::any();
    const dds::Participant participant({claim.domain(), {}});
    const Serialisers serialisers(participant);
    while (const auto request = next_request()) serialisers.serve(*request);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "ros2_cdr: %s\n", error.what());
    return 1;
  }
  return 0;
}
