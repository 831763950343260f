/// A WebSocket client for tests: real sockets, and room to break the rules.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/os/descriptor.hpp"

namespace kilotwin::test {

class WebSocketClient {
 public:
  struct Handshake {
    std::string host = "127.0.0.1";  ///< the port is added
    std::string origin = {};         ///< empty: none
    std::string protocol = "kilotwin-view.1";
  };
  struct Message {
    int opcode = 0;  ///< 1 text, 2 binary, 8 close
    std::string payload;
    [[nodiscard]] bool is(std::string_view type) const {
      return opcode == 1 && payload.find("\"type\":\"" + std::string(type) + "\"") != std::string::npos;
    }
    /// Of a close frame; 0: none.
    [[nodiscard]] int close_status() const;
  };

  explicit WebSocketClient(std::uint16_t port) : WebSocketClient(port, Handshake{}) {}
  WebSocketClient(std::uint16_t port, const Handshake& handshake);

  /// The server has agreed.
  [[nodiscard]] bool open() const { return open_; }
  /// The head of its answer.
  [[nodiscard]] const std::string& answer() const { return answer_; }
  void send_text(std::string_view text) { send_frame(1, text); }
  void send_frame(int opcode, std::string_view payload, bool final = true);
  /// As it is.
  void send_bytes(std::string_view bytes);
  /// The next message; nothing where none comes within `seconds` or the connection has ended.
  [[nodiscard]] std::optional<Message> read(double seconds = 90);
  /// The next message of a type, others are passed over; "frame": the next binary one.
  [[nodiscard]] std::optional<Message> await(std::string_view type, double seconds = 90);
  /// Reads until the server has closed the connection. Returns the status of its close frame, 0 without one, -1 if it stays open.
  [[nodiscard]] int closed(double seconds = 90);

 private:
  [[nodiscard]] bool receive(double seconds);

  os::Descriptor socket_;
  std::string answer_, buffer_;
  bool open_ = false, ended_ = false;
};

/// The whole answer to a request that is sent as it is.
[[nodiscard]] std::string http(std::uint16_t port, const std::string& request);

}  // namespace kilotwin::test
