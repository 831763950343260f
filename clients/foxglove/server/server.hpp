/// Server of the Foxglove WebSocket protocol, version 1, on 127.0.0.1. Foxglove and Lichtblick connect to it: "Open connection",
/// "Foxglove WebSocket". It speaks under the protocol's two names, foxglove.websocket.v1 and foxglove.sdk.v1.
///
/// Viewers can only look. A slow one gets fewer messages: of each channel the newest that matter. What waits for it is bounded, and
/// no viewer delays write() or another viewer. One that breaks the rules is disconnected: a message that is too long or no JSON,
/// or too many subscriptions. A connection whose `Host` is not this machine is refused; pages of any origin may look, since
/// viewers are pages of other origins.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "clients/foxglove/topics.hpp"

namespace kilotwin::foxglove {

inline constexpr std::uint16_t kUsualPort = 8765;
inline constexpr std::uint32_t kMostViewers = 64;
inline constexpr std::size_t kMostSubscriptions = 256, kLongestRequest_bytes = 65536;

class Server final : public Sink {
 public:
  /// Serves from a thread of its own. Port 0: one that is free. Throws UserError where the port is taken.
  explicit Server(std::uint16_t port);
  ~Server() override;
  Server(const Server&) = delete;

  /// Another run: its viewers forget the channels. `session`: differs from run to run.
  void begin(std::string session);
  [[nodiscard]] std::uint16_t add_channel(std::string_view topic, std::string_view schema_name,
                                          std::string_view schema, std::size_t matter) override;
  void write(std::uint16_t channel, Time_ns time, std::string_view message) override;

  [[nodiscard]] std::uint16_t port() const;
  [[nodiscard]] std::uint32_t viewers() const;

 private:
  class Service;
  std::unique_ptr<Service> service_;
};

}  // namespace kilotwin::foxglove
