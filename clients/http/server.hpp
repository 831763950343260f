/// Server: libwebsockets on one address and port, with or without TLS, served from a thread of its own.
///
/// What is served is up to the protocols, whose callbacks run on that thread. Their user pointer is that of the context:
/// lws_context_user(). Declare the server as the last member of what the callbacks use: it ends before the rest.
#pragma once

#include <libwebsockets.h>

#include <atomic>
#include <cstdint>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "clients/http/endpoint.hpp"

namespace kilotwin::http {

/// A header of the request, at most 255 octets; empty where it is absent or longer.
[[nodiscard]] std::string header_of(lws* connection, lws_token_indexes token);
/// Whether the request has no `Origin`. Browsers always state the origin of a page that opens a WebSocket; other programs have none.
[[nodiscard]] bool has_no_origin(lws* connection);
/// What a callback returns to close a WebSocket with a reason.
[[nodiscard]] int closed(lws* connection, lws_close_status status, std::string reason);
/// Adds a part of a WebSocket message to `message`. Returns whether the message is whole.
[[nodiscard]] bool is_whole(lws* connection, std::string& message, std::string_view part);

class Server {
 public:
  /// `wanted`: protocols, user, and bounds other than the library's; address and identity are set here. Throws UserError with the
  /// words `refusal` where the port cannot be served, and what Endpoint::check() throws.
  Server(const Endpoint& endpoint, lws_context_creation_info wanted, const std::string& refusal);
  ~Server();
  Server(const Server&) = delete;

  [[nodiscard]] std::uint16_t port() const { return port_; }
  /// "http://127.0.0.1:8000": what stands before the path in addresses.
  [[nodiscard]] std::string origin() const;
  /// Whether the request's `Host` is the endpoint's: a page of another origin could reach the port under a name of its own.
  [[nodiscard]] bool is_named_by(lws* connection) const;
  /// Whether the request comes from a page of this server, or from no page.
  [[nodiscard]] bool is_own_page(lws* connection) const;
  /// Wakes the thread: every protocol gets LWS_CALLBACK_EVENT_WAIT_CANCELLED. From any thread.
  void wake();
  /// Writes from a callback. False where the library took less than all; what the socket does not take at once, it keeps.
  [[nodiscard]] bool write(lws* connection, std::string_view text, lws_write_protocol protocol);

 private:
  const Endpoint endpoint_;
  lws_context* context_ = nullptr;
  std::uint16_t port_ = 0;
  std::atomic<bool> ends_{false};
  std::vector<unsigned char> buffer_;  // of the thread
  std::thread thread_;
};

}  // namespace kilotwin::http
