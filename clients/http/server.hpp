/// LoopbackServer: libwebsockets on a port of 127.0.0.1, served from a thread of its own.
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

namespace kilotwin::http {

/// Whether the request's `Host` is this machine: a page of another origin could reach the port under a name of its own.
[[nodiscard]] bool names_this_machine(lws* connection);
/// A header of the request, at most 255 octets; empty where it is absent or longer.
[[nodiscard]] std::string header_of(lws* connection, lws_token_indexes token);
/// What a callback returns to close a WebSocket with a reason.
[[nodiscard]] int closed(lws* connection, lws_close_status status, std::string reason);
/// Adds a part of a WebSocket message to `message`. Returns whether the message is whole.
[[nodiscard]] bool is_whole(lws* connection, std::string& message, std::string_view part);

class LoopbackServer {
 public:
  /// `wanted`: protocols, user, and bounds other than the library's; address and identity are set here. Port 0: one that is free.
  /// Throws UserError with the words `refusal` where the port cannot be served.
  LoopbackServer(std::uint16_t port, lws_context_creation_info wanted, const std::string& refusal);
  ~LoopbackServer();
  LoopbackServer(const LoopbackServer&) = delete;

  [[nodiscard]] std::uint16_t port() const { return port_; }
  /// Wakes the thread: every protocol gets LWS_CALLBACK_EVENT_WAIT_CANCELLED. From any thread.
  void wake();
  /// Writes from a callback. False where the library took less than all; what the socket does not take at once, it keeps.
  [[nodiscard]] bool write(lws* connection, std::string_view text, lws_write_protocol protocol);

 private:
  lws_context* context_ = nullptr;
  std::uint16_t port_ = 0;
  std::atomic<bool> ends_{false};
  std::vector<unsigned char> buffer_;  // of the thread
  std::thread thread_;
};

}  // namespace kilotwin::http
