#include "clients/http/server.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netdb.h>
#include <netinet/in.h>
#include <strings.h>

#include <algorithm>
#include <array>

#include "core/base/error.hpp"

namespace kilotwin::http {

std::string header_of(lws* connection, lws_token_indexes token) {
  std::array<char, 256> text{};
  const int length = lws_hdr_copy(connection, text.data(), static_cast<int>(text.size()), token);
  return length > 0 ? std::string(text.data(), static_cast<std::size_t>(length)) : std::string();
}

bool has_no_origin(lws* connection) { return lws_hdr_total_length(connection, WSI_TOKEN_ORIGIN) == 0; }

int closed(lws* connection, lws_close_status status, std::string reason) {
  lws_close_reason(connection, status, reinterpret_cast<unsigned char*>(reason.data()), reason.size());
  return -1;
}

bool is_whole(lws* connection, std::string& message, std::string_view part) {
  message += part;
  return lws_is_final_fragment(connection) != 0 && lws_remaining_packet_payload(connection) == 0;
}

namespace {

/// The IPv4 address of a name of this machine. Throws UserError.
std::string address_of(const std::string& host) {
  addrinfo wanted{};
  wanted.ai_family = AF_INET;
  addrinfo* found = nullptr;
  if (::getaddrinfo(host.c_str(), nullptr, &wanted, &found) != 0 || found == nullptr)
    throw UserError(
        fmt::format("--listen {}: has no IPv4 address; give the address or the name of this machine", host));
  std::array<char, INET_ADDRSTRLEN> text{};
  ::inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in*>(found->ai_addr)->sin_addr, text.data(), text.size());
  ::freeaddrinfo(found);
  return text.data();
}

}  // namespace

Server::Server(const Endpoint& endpoint, lws_context_creation_info wanted, const std::string& refusal)
    : endpoint_(endpoint) {
  endpoint.check();
  const std::string address = address_of(endpoint.host);
  lws_set_log_level(0, nullptr);
  wanted.port = endpoint.port;
  wanted.iface = address.c_str();
  wanted.gid = -1;
  wanted.uid = -1;
  wanted.options = LWS_SERVER_OPTION_EXPLICIT_VHOSTS | LWS_SERVER_OPTION_DISABLE_IPV6;
  if (endpoint.encrypted()) {
    wanted.options |= LWS_SERVER_OPTION_DO_SSL_GLOBAL_INIT;
    wanted.ssl_cert_filepath = endpoint_.certificate.c_str();
    wanted.ssl_private_key_filepath = endpoint_.key.c_str();
    wanted.alpn = "http/1.1";  // HTTP/2 states no `Host`
  }
  context_ = lws_create_context(&wanted);
  lws_vhost* const host = context_ == nullptr ? nullptr : lws_create_vhost(context_, &wanted);
  if (host == nullptr) {
    if (context_ != nullptr) lws_context_destroy(context_);
    throw UserError(endpoint.encrypted() ? refusal + "; with TLS the key must be that of the certificate"
                                         : refusal);
  }
  port_ = static_cast<std::uint16_t>(lws_get_vhost_listen_port(host));
  thread_ = std::thread([this] {
    while (!ends_ && lws_service(context_, 0) >= 0) {}
  });
}

Server::~Server() {
  ends_ = true;
  lws_cancel_service(context_);
  thread_.join();
  lws_context_destroy(context_);
}

std::string Server::origin() const {
  return fmt::format("{}://{}:{}", endpoint_.encrypted() ? "https" : "http", endpoint_.host, port_);
}

bool Server::is_named_by(lws* connection) const {
  const std::string host = header_of(connection, WSI_TOKEN_HOST);
  const std::string name = host.substr(0, host.rfind(':'));
  return strcasecmp(name.c_str(), endpoint_.host.c_str()) == 0 ||
         (endpoint_.is_loopback() && (name == "127.0.0.1" || name == "localhost"));
}

bool Server::is_own_page(lws* connection) const {
  return has_no_origin(connection) ||
         header_of(connection, WSI_TOKEN_ORIGIN) ==
             (endpoint_.encrypted() ? "https://" : "http://") + header_of(connection, WSI_TOKEN_HOST);
}

void Server::wake() { lws_cancel_service(context_); }

bool Server::write(lws* connection, std::string_view text, lws_write_protocol protocol) {
  // The library wants room in front of what it writes.
  buffer_.resize(LWS_PRE + text.size());
  std::copy(text.begin(), text.end(), buffer_.begin() + LWS_PRE);
  return lws_write(connection, buffer_.data() + LWS_PRE, text.size(), protocol) >= static_cast<int>(text.size());
}

}  // namespace kilotwin::http
