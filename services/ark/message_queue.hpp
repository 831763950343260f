/// The queue of the overhead controller: messages to single robots, three to a packet, and broadcasts, which go first.
///
/// Of one environment a robot has at most one message that waits: a newer one replaces it and keeps its place. A robot can be
/// served once its least interval has passed. Those that can be served go in the order in which they could be first; of
/// two that could be at once the robot of the lower id. With bit fields one message carries the latest values of all
/// environments; without, a robot's environments take turns.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/time.hpp"
#include "core/plan/station_settings.hpp"
#include "services/ark/ark_message.hpp"

namespace kilotwin::proto {
class MessageQueueState;
}

namespace kilotwin::ark {

/// Since the start of the run.
struct QueueCounts {
  std::uint64_t packets = 0;         ///< of both kinds
  std::uint64_t robot_messages = 0;  ///< to single robots
  std::uint64_t broadcasts = 0;
  std::uint64_t replaced = 0;  ///< messages that a newer one replaced while they waited
  std::uint64_t too_wide = 0;  ///< messages dropped, as they did not fit in their environment's bits
  /// Entry d: messages that left between d and d + 1 times kDelayBin_s after the request, or after the first of those
  /// that replaced each other; the last entry: so long or longer.
  std::vector<std::uint64_t> delays;
};

inline constexpr double kDelayBin_s = 0.01;

class MessageQueue {
 public:
  /// An instant or a length of simulated time, cycles of the robots' nominal clock; the start is 0.
  using Cycles = std::int64_t;

  /// `robot_interval`: the least one of a robot.
  MessageQueue(std::uint32_t robots, const std::vector<EnvironmentSettings>&, Cycles robot_interval);

  void put(std::uint32_t environment, const ArkMessage& message, Cycles now);
  void put_broadcast(const IrMessage& message) { broadcasts_.push_back(message); }
  /// The next packet, if anything can be sent.
  [[nodiscard]] std::optional<IrMessage> take(Cycles now);
  /// When a message that waits can be sent first; nothing where none waits.
  [[nodiscard]] std::optional<Cycles> earliest() const;

  [[nodiscard]] const QueueCounts& counts() const { return counts_; }
  /// Of all that future packets depend on.
  [[nodiscard]] std::uint64_t word() const;
  void save(proto::MessageQueueState&) const;
  /// Throws RunError where the state is of another experiment.
  void load(const proto::MessageQueueState&);

 private:
  static constexpr std::size_t kDelayBins = 3000;

  /// The first instant at which the robot could be served; nothing where no message waits for it.
  [[nodiscard]] std::optional<Cycles> ready(std::uint32_t robot) const;
  [[nodiscard]] ArkMessage serve(std::uint32_t robot, Cycles now);
  void count_delay(Cycles asked, Cycles now);
  [[nodiscard]] std::size_t slot(std::uint32_t robot, std::uint32_t environment) const {
    return std::size_t{robot} * environments_ + environment;
  }

  std::uint32_t robots_, environments_;
  Cycles robot_interval_;
  std::vector<BitFieldSettings> fields_;  ///< per environment; empty: whole messages

  // Per robot and environment.
  std::vector<std::uint16_t> word_;  ///< type << 10 | data of the latest message
  std::vector<Cycles> asked_;        ///< when the first one that waits came; kNever: none waits
  // Per robot.
  std::vector<Cycles> served_;
  std::vector<std::uint32_t> next_environment_;

  std::vector<IrMessage> broadcasts_;  ///< oldest first
  QueueCounts counts_;
};

}  // namespace kilotwin::ark
