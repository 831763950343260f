#include "clients/http/endpoint.hpp"

#include <fmt/format.h>

#include <fstream>

#include "core/base/error.hpp"

namespace kilotwin::http {
namespace {

void require_pem(const char* option, const std::filesystem::path& file, std::string_view kind) {
  std::ifstream in(file);
  std::string text(1 << 16, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (in.gcount() == 0)
    throw UserError(fmt::format("{} {}: cannot be read; give a PEM file", option, file.string()));
  if (text.find("-----BEGIN ") == std::string::npos || text.find(kind) == std::string::npos)
    throw UserError(fmt::format("{} {}: is no PEM file with a {}", option, file.string(), kind));
}

}  // namespace

void Endpoint::check() const {
  if (certificate.empty() != key.empty())
    throw UserError("--certificate and --key belong together; give both PEM files, or neither");
  if (host.empty() || host == "0.0.0.0" || host.find_first_of("/:[]@ ") != std::string::npos) {
    throw UserError(fmt::format(
        "--listen {}: is no address that a browser can open; give the IPv4 address or the name of this machine",
        host));
  }
  if (!encrypted() && !is_loopback()) {
    throw UserError(fmt::format(
        "--listen {}: other machines are served with TLS only; give --certificate FILE and --key FILE, or leave "
        "--listen out and forward the port by SSH",
        host));
  }
  if (!encrypted()) return;
  require_pem("--certificate", certificate, "CERTIFICATE");
  require_pem("--key", key, "PRIVATE KEY");
}

}  // namespace kilotwin::http
