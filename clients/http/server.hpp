/// Server: libwebsockets on one address and port, with or without TLS, served from a thread of its own.
///
/// The caller's libwebsockets protocols define what is served. Their callbacks run on the server's thread and find their object by
/// lws_context_user(). Declare the server as that object's last member, so that its thread ends before other members are destroyed.
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
/// The value that a callback returns to close a WebSocket with a reason.
[[nodiscard]] int closed(lws* connection, lws_close_status status, std::string reason);
/// Adds a part of a WebSocket message to `message`. Returns whether the message is whole.
[[nodiscard]] bool is_whole(lws* connection, std::string& message, std::string_view part);

class Server {
 public:
  /// `wanted`: protocols, user pointer and limits; the constructor sets address, port and certificate. Throws UserError with the
  /// text `refusal` if the port cannot be served. Throws what Endpoint::check() throws.
  Server(const Endpoint& endpoint, lws_context_creation_info wanted, const std::string& refusal);
  ~Server();
  Server(const Server&) = delete;

  [[nodiscard]] std::uint16_t port() const { return port_; }
  /// "http://127.0.0.1:8000": what stands before the path in addresses.
  [[nodiscard]] std::string origin() const;
  /// Whether the request's `Host` names this endpoint. A page of another origin can reach the port by a name of its own (DNS
  /// rebinding); its requests then carry that name.
  [[nodiscard]] bool is_named_by(lws* connection) const;
  /// Whether the request comes from a page of this server, or from no page.
  [[nodiscard]] bool is_own_page(lws* connection) const;
  /// Wakes the thread: every protocol gets LWS_CALLBACK_EVENT_WAIT_CANCELLED. From any thread.
  void wake();
  /// Sends a message; to be called from a callback. libwebsockets buffers what the socket does not take. False on failure.
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
