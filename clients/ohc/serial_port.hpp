/// A serial port with a physical overhead controller on it.
#pragma once

#include <chrono>
#include <filesystem>
#include <span>
#include <string>

#include "clients/ohc/serial_packet.hpp"
#include "core/os/descriptor.hpp"

namespace kilotwin::ohc {

class SerialPort {
 public:
  explicit SerialPort(std::filesystem::path device) : device_(std::move(device)) {}

  /// Opens it as station programs do: 38400 baud, 8N1, raw, no flow control, for this process alone. Returns why it cannot,
  /// or an empty string.
  [[nodiscard]] std::string open();
  void close() { port_.reset(); }
  [[nodiscard]] bool is_open() const { return port_.get() >= 0; }
  /// Sends a packet and waits until it has left. False where the port is gone or does not move for two seconds.
  [[nodiscard]] bool send(const OverheadPacket& packet);
  /// Whether the other end has hung up.
  [[nodiscard]] bool is_gone() const;
  [[nodiscard]] const std::filesystem::path& device() const { return device_; }

 private:
  std::filesystem::path device_;
  os::Descriptor port_;
};

/// Sends packets that come by a socket that keeps messages apart, until that ends; then STOP. A port that is lost is opened
/// again when it is back; the last packet is then repeated. Each packet is confirmed on the socket once the controller is ready
/// for the next.
void serve_port(SerialPort& port, int socket);

/// Sends a packet by that socket, and waits until it is confirmed. False where the server has ended.
[[nodiscard]] bool send_packet(int socket, const OverheadPacket& packet);

}  // namespace kilotwin::ohc
