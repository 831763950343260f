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
  /// A packet takes 34 ms on the line; `patience` is how long the port may be busy with what it has.
  explicit SerialPort(std::filesystem::path device, std::chrono::milliseconds patience = std::chrono::seconds(2))
      : device_(std::move(device)), patience_(patience) {}

  /// Opens it as station programs do: 38400 baud, 8N1, raw, no flow control, for this process alone. Returns why it cannot,
  /// or an empty string.
  [[nodiscard]] std::string open();
  /// Octets that have not left yet are dropped: the system would wait for it.
  void close();
  [[nodiscard]] bool is_open() const { return port_.get() >= 0; }
  /// Sends a packet and waits until it has left. False where the port is gone, or does not move for the time of its patience;
  /// failure() then says which.
  [[nodiscard]] bool send(const OverheadPacket& packet);
  /// Of the last packet that was not sent.
  [[nodiscard]] const std::string& failure() const { return failure_; }
  /// Whether the other end has hung up.
  [[nodiscard]] bool is_gone() const;
  [[nodiscard]] const std::filesystem::path& device() const { return device_; }

 private:
  [[nodiscard]] bool drain();
  bool fail(std::string reason);
  [[nodiscard]] std::string stalled() const;

  std::filesystem::path device_;
  std::chrono::milliseconds patience_;
  os::Descriptor port_;
  std::string failure_;
};

/// Sends packets that come by a socket that keeps messages apart, until that ends; then STOP. A port that is lost is opened
/// again when it is back; the last packet is then repeated. Each packet is confirmed on the socket once the controller is ready
/// for the next.
void serve_port(SerialPort& port, int socket);

/// Sends a packet by that socket, and waits until it is confirmed. False where the server has ended.
[[nodiscard]] bool send_packet(int socket, const OverheadPacket& packet);

}  // namespace kilotwin::ohc
