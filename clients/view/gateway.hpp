/// Gateway: the page over HTTP and runs over a WebSocket, on 127.0.0.1 or, with TLS, on an address that other machines reach.
///
/// A viewer gets text messages, JSON objects with a `type`, and binary frames (frame_code.hpp); it sends requests (request.hpp).
/// A viewer gets one frame per request, so a slow one gets fewer frames, and one that stalls gets none. Requests that it has not
/// been answered replace each other. A viewer that breaks the rules is disconnected: a message that is too long or no request,
/// or more than http::kMostRequestsPerSecond. No viewer delays post_frame().
///
/// One thread answers. Next is the viewer whose answers have taken least time, so one that asks expensive questions waits for the
/// others, and they wait for one of its answers at most.
///
/// Browsers let pages of any origin open a WebSocket. The gateway therefore serves only requests whose `Host` is its own
/// and whose `Origin` is the page's own. To steer a run, a viewer shows the token that its address carries.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "clients/http/endpoint.hpp"
#include "clients/view/page_files.hpp"
#include "clients/view/request.hpp"

namespace kilotwin::view {

inline constexpr const char* kSubprotocol = "kilotwin-view.1";
inline constexpr std::uint32_t kMostViewers = 64;

/// Answers what viewers ask. The gateway calls it from its own thread, one call at a time.
class Answers {
 public:
  virtual ~Answers() = default;
  /// The state at or before a tick, as a frame; empty: there is none.
  [[nodiscard]] virtual std::string frame_at(std::int64_t tick, std::uint32_t request) = 0;
  /// The pictures on the floor at that tick: a number that changes with them, and a message of type "floors".
  [[nodiscard]] virtual std::uint64_t floors_version(std::int64_t tick) = 0;
  [[nodiscard]] virtual std::string floors_at(std::int64_t tick) = 0;
  /// The light at that tick, a message of type "light". Empty: the run has none.
  [[nodiscard]] virtual std::string light(std::int64_t tick) = 0;
  /// A text message, or empty: there is none.
  [[nodiscard]] virtual std::string trail(std::uint32_t robot, std::int64_t tick) = 0;
  [[nodiscard]] virtual std::string robot(std::uint32_t robot, std::int64_t tick) = 0;
  [[nodiscard]] virtual std::string plots() = 0;
  /// Of a robot, or of the swarm.
  [[nodiscard]] virtual std::string plot(std::uint32_t number, std::optional<std::uint32_t> robot) = 0;
  [[nodiscard]] virtual std::string program(std::uint32_t robot, std::int64_t tick) = 0;
  [[nodiscard]] virtual std::string outside(std::int64_t tick) = 0;
  /// Messages that ended after `from`, up to `tick`.
  [[nodiscard]] virtual std::string flights(std::int64_t from, std::int64_t tick) = 0;
  [[nodiscard]] virtual std::string work() = 0;
  [[nodiscard]] virtual std::string marks() = 0;
  /// Steers the run. Returns empty, or why it cannot.
  [[nodiscard]] virtual std::string steer(const Request& request) = 0;
};

class Gateway {
 public:
  struct Traffic {
    std::uint32_t viewers = 0;
    std::uint64_t frames = 0, bytes = 0, refused = 0;  ///< since the start; refused: connections and broken rules
  };

  /// Tells the time by which answers are counted, in seconds since any moment. Called from the gateway's thread.
  using Clock_s = std::function<double()>;

  /// Serves from a thread of its own. `token`: 16 characters or more. Without a clock, the steady one of the system counts.
  /// Throws UserError where the endpoint cannot be served.
  Gateway(const http::Endpoint& endpoint, std::string token, PageFiles page, Clock_s clock = {});
  ~Gateway();
  Gateway(const Gateway&) = delete;

  [[nodiscard]] std::uint16_t port() const;
  /// The address of the page, with the token.
  [[nodiscard]] std::string address() const;
  /// Begins a run: every viewer gets its description, and `answers` answers. It must outlive the gateway, or the next call.
  void show(Answers& answers, std::string run_text);
  /// Every viewer gets it; of several, the newest counts. `frame` answers "next".
  void post_status(std::string text);
  void post_frame(std::string frame);
  [[nodiscard]] Traffic traffic() const;

 private:
  class Service;
  std::unique_ptr<Service> service_;
};

/// 32 hexadecimal digits from the system's random numbers.
[[nodiscard]] std::string random_token();

}  // namespace kilotwin::view
