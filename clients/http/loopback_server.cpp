#include "clients/http/loopback_server.hpp"

#include <algorithm>

#include "core/base/error.hpp"

namespace kilotwin::http {

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
