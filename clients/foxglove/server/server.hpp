/// Server of the Foxglove WebSocket protocol, version 1. Foxglove and Lichtblick connect to it: "Open connection",
/// "Foxglove WebSocket". It speaks under the protocol's two names, foxglove.websocket.v1 and foxglove.sdk.v1.
///
/// Viewers can only look. A slow one gets fewer messages: of each channel the newest that matter. Its queue is bounded, and
/// no viewer delays write() or another viewer. One that breaks the rules is disconnected: a message that is too long or no JSON,
/// too many subscriptions, or more than http::kMostRequestsPerSecond.
///
/// Browsers let pages of any origin open a WebSocket. The server therefore refuses connections whose `Host` is not its own.
/// It serves the pages of Foxglove, of Lichtblick, of this machine, and of the origins that it was given, and no others. A sandboxed page has
/// the origin "null": it is refused.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "clients/foxglove/topics.hpp"
#include "clients/http/endpoint.hpp"

namespace kilotwin::foxglove {

inline constexpr std::uint16_t kUsualPort = 8765;
inline constexpr std::uint32_t kMostViewers = 64;
inline constexpr std::size_t kMostSubscriptions = 256, kLongestRequest_bytes = 65536;

class Server final : public Sink {
 public:
  /// Serves from a thread of its own. `origins`: of further viewers, such as "https://viewer.example". Throws UserError where the
  /// endpoint cannot be served.
  explicit Server(const http::Endpoint& endpoint, std::vector<std::string> origins = {});
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
