#include "tests/clients/view/websocket_client.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <array>
#include <chrono>
#include <stdexcept>

namespace kilotwin::test {
namespace {

using Clock = std::chrono::steady_clock;

os::Descriptor connected(std::uint16_t port) {
  os::Descriptor socket(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    throw std::runtime_error("connect() failed");
  return socket;
}

std::uint64_t big_endian(std::string_view bytes) {
  std::uint64_t value = 0;
  for (const char byte : bytes) value = value << 8 | static_cast<std::uint8_t>(byte);
  return value;
}

}  // namespace

int WebSocketClient::Message::close_status() const {
  return opcode == 8 && payload.size() >= 2 ? static_cast<int>(big_endian(payload.substr(0, 2))) : 0;
}

WebSocketClient::WebSocketClient(std::uint16_t port, const Handshake& handshake) : socket_(connected(port)) {
  std::string request = fmt::format(
      "GET / HTTP/1.1\r\nHost: {}:{}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
      "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n",
      handshake.host, port);
  if (!handshake.origin.empty()) request += "Origin: " + handshake.origin + "\r\n";
  if (!handshake.protocol.empty()) request += "Sec-WebSocket-Protocol: " + handshake.protocol + "\r\n";
  send_bytes(request + "\r\n");
  while (buffer_.find("\r\n\r\n") == std::string::npos && receive(30)) {}
  const std::size_t end = buffer_.find("\r\n\r\n");
  answer_ = buffer_.substr(0, end);
  open_ = end != std::string::npos && answer_.find(" 101 ") != std::string::npos;
  buffer_.erase(0, end == std::string::npos ? buffer_.size() : end + 4);
}

void WebSocketClient::send_bytes(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = ::send(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent <= 0) return;  // the server has closed: closed() tells
    bytes.remove_prefix(static_cast<std::size_t>(sent));
  }
}

void WebSocketClient::send_frame(int opcode, std::string_view payload, bool final) {
  std::string frame(1, static_cast<char>((final ? 0x80 : 0) | opcode));
  if (payload.size() < 126) {
    frame += static_cast<char>(0x80 | payload.size());
  } else if (payload.size() < 65536) {
    frame += static_cast<char>(0x80 | 126);
    for (int shift = 8; shift >= 0; shift -= 8) frame += static_cast<char>(payload.size() >> shift & 255);
  } else {
    frame += static_cast<char>(0x80 | 127);
    for (int shift = 56; shift >= 0; shift -= 8) frame += static_cast<char>(payload.size() >> shift & 255);
  }
  frame.append(4, '\0');  // a mask that changes nothing
  send_bytes(frame.append(payload));
}

/// Waits for more bytes; false at the end of the connection or of the time.
bool WebSocketClient::receive(double seconds) {
  pollfd waiting{socket_.get(), POLLIN, 0};
  if (ended_ || poll(&waiting, 1, static_cast<int>(seconds * 1000)) <= 0) return false;
  std::array<char, 65536> bytes;
  const ssize_t count = recv(socket_.get(), bytes.data(), bytes.size(), 0);
  ended_ = count <= 0;
  if (!ended_) buffer_.append(bytes.data(), static_cast<std::size_t>(count));
  return !ended_;
}

std::optional<WebSocketClient::Message> WebSocketClient::read(double seconds) {
  const auto until = Clock::now() + std::chrono::duration<double>(seconds);
  for (;;) {
    if (buffer_.size() >= 2) {
      std::size_t header = 2;
      std::uint64_t length = static_cast<std::uint8_t>(buffer_[1]) & 127u;
      if (length >= 126) header += length == 126 ? 2 : 8;
      if (buffer_.size() >= header) {
        if (header > 2) length = big_endian(std::string_view(buffer_).substr(2, header - 2));
        if (buffer_.size() >= header + length) {
          Message message{buffer_[0] & 15, buffer_.substr(header, length)};
          buffer_.erase(0, header + length);
          return message;
        }
      }
    }
    const double left = std::chrono::duration<double>(until - Clock::now()).count();
    if (left < 0 || !receive(left)) return std::nullopt;
  }
}

std::optional<WebSocketClient::Message> WebSocketClient::await(std::string_view type, double seconds) {
  while (auto message = read(seconds)) {
    if (type == "frame" ? message->opcode == 2 : message->is(type)) return message;
  }
  return std::nullopt;
}

int WebSocketClient::closed(double seconds) {
  int status = 0;
  while (const auto message = read(seconds)) {
    if (message->opcode != 8) continue;
    status = message->close_status();
    send_frame(8, message->payload);  // or the server waits for it
  }
  return ended_ ? status : -1;
}

std::string http(std::uint16_t port, const std::string& request) {
  const os::Descriptor socket = connected(port);
  if (::send(socket.get(), request.data(), request.size(), MSG_NOSIGNAL) < 0) return {};
  std::string answer;
  pollfd waiting{socket.get(), POLLIN, 0};
  // Connection: close ends the answer; the bound is against hanging.
  while (poll(&waiting, 1, 10000) > 0) {
    std::array<char, 65536> bytes;
    const ssize_t count = recv(socket.get(), bytes.data(), bytes.size(), 0);
    if (count <= 0) break;
    answer.append(bytes.data(), static_cast<std::size_t>(count));
  }
  return answer;
}

}  // namespace kilotwin::test
