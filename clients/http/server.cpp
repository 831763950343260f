#include "clients/http/loopback_server.hpp"

#include <algorithm>
#include <array>

#include "core/base/error.hpp"

namespace kilotwin::http {

std::string header_of(lws* connection, lws_token_indexes token) {
  std::array<char, 256> text{};
  const int length = lws_hdr_copy(connection, text.data(), static_cast<int>(text.size()), token);
  return length > 0 ? std::string(text.data(), static_cast<std::size_t>(length)) : std::string();
}

bool names_this_machine(lws* connection) {
  const std::string host = header_of(connection, WSI_TOKEN_HOST);
  const std::string name = host.substr(0, host.rfind(':'));
  return name == "127.0.0.1" || name == "localhost";
}

int closed(lws* connection, lws_close_status status, std::string reason) {
  lws_close_reason(connection, status, reinterpret_cast<unsigned char*>(reason.data()), reason.size());
  return -1;
}

bool is_whole(lws* connection, std::string& message, std::string_view part) {
  message += part;
  return lws_is_final_fragment(connection) != 0 && lws_remaining_packet_payload(connection) == 0;
}

LoopbackServer::LoopbackServer(std::uint16_t port, lws_context_creation_info wanted, const std::string& refusal) {
  lws_set_log_level(0, nullptr);
  wanted.port = port;
  wanted.iface = "127.0.0.1";
  wanted.gid = -1;
  wanted.uid = -1;
  wanted.options = LWS_SERVER_OPTION_EXPLICIT_VHOSTS | LWS_SERVER_OPTION_DISABLE_IPV6;
  context_ = lws_create_context(&wanted);
  lws_vhost* const host = context_ == nullptr ? nullptr : lws_create_vhost(context_, &wanted);
  if (host == nullptr) {
    if (context_ != nullptr) lws_context_destroy(context_);
    throw UserError(refusal);
  }
  port_ = static_cast<std::uint16_t>(lws_get_vhost_listen_port(host));
  thread_ = std::thread([this] {
    while (!ends_ && lws_service(context_, 0) >= 0) {}
  });
}

LoopbackServer::~LoopbackServer() {
  ends_ = true;
  lws_cancel_service(context_);
  thread_.join();
  lws_context_destroy(context_);
}

void LoopbackServer::wake() { lws_cancel_service(context_); }

bool LoopbackServer::write(lws* connection, std::string_view text, lws_write_protocol protocol) {
  // The library wants room in front of what it writes.
  buffer_.resize(LWS_PRE + text.size());
  std::copy(text.begin(), text.end(), buffer_.begin() + LWS_PRE);
  return lws_write(connection, buffer_.data() + LWS_PRE, text.size(), protocol) >= static_cast<int>(text.size());
}

}  // namespace kilotwin::http
