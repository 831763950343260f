/// Endpoint: where a server listens, and how.
#pragma once

#include <strings.h>

#include <cstdint>
#include <filesystem>
#include <string>

namespace kilotwin::http {

struct Endpoint {
  Endpoint(std::uint16_t at = 0) : port(at) {}  // NOLINT: a port of this machine alone
  std::uint16_t port;                           ///< 0: one that is free
  std::string host = "127.0.0.1";  ///< IPv4 address or name of this machine, as it stands in the page's address
  /// PEM files: the chain of certificates and its private key. Both, or neither: then it serves without TLS.
  std::filesystem::path certificate, key;

  [[nodiscard]] bool encrypted() const { return !certificate.empty(); }
  /// Whether the host is a loopback address, or localhost.
  [[nodiscard]] bool is_loopback() const {
    return strcasecmp(host.c_str(), "localhost") == 0 ||
           (host.starts_with("127.") && host.find_first_not_of("0123456789.") == std::string::npos);
  }
  /// Throws UserError if other machines could connect without TLS; if a file cannot be read; or if the host cannot stand in an
  /// address. It names the options --listen, --certificate and --key of `kilotwin view`.
  void check() const;
};

}  // namespace kilotwin::http
