#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>

#include "core/base/error.hpp"
#include "core/dds/dds.hpp"

namespace kilotwin::dds {
namespace {

// An abstract socket name serves as a lock: the kernel frees it with the process, and it leaves no file.
int claim_name(std::uint32_t domain) {
  const int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return -1;
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string name = fmt::format("kilotwin-domain-{}", domain);
  std::memcpy(address.sun_path + 1, name.data(), name.size());
  const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
  if (bind(fd, reinterpret_cast<const sockaddr*>(&address), length) == 0) return fd;
  close(fd);
  return -1;
}

// Every participant of a domain takes the first free discovery port (RTPS 9.6.1.1). So if the port of index 0 is taken, some
// DDS program, Kilotwin or another, uses the domain.
bool discovery_port_is_free(std::uint32_t domain, std::uint32_t index) {
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return false;
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_ANY);
  address.sin_port = htons(static_cast<std::uint16_t>(7400 + 250 * domain + 10 + 2 * index));
  const bool is_free = bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  close(fd);
  return is_free;
}

}  // namespace

bool domain_is_full(std::uint32_t domain) {
  for (std::uint32_t index = 0; index < kMostParticipants; ++index) {
    if (discovery_port_is_free(domain, index)) return false;
  }
  return true;
}

DomainClaim DomainClaim::any() {
  // Runs start their search at different domains, so that two simultaneous starts do not try the same ones.
  const auto start = static_cast<std::uint32_t>(getpid()) % (kLastDomain - 1);
  for (std::uint32_t i = 0; i < kLastDomain; ++i) {
    const std::uint32_t domain = 1 + (start + i) % kLastDomain;
    const int fd = claim_name(domain);
    if (fd < 0) continue;
    if (discovery_port_is_free(domain, 0)) return {domain, fd};
    close(fd);
  }
  throw RunError(fmt::format("all DDS domains from 1 to {} are in use on this machine", kLastDomain));
}

DomainClaim DomainClaim::exactly(std::uint32_t wanted) {
  if (wanted > kLastDomain) {
    throw UserError(fmt::format("--domain: {} does not exist; domains are 0 to {}", wanted, kLastDomain));
  }
  const int fd = claim_name(wanted);
  if (fd >= 0) return {wanted, fd};  // Clients may have joined before, so a taken port is no error here.
  throw UserError(
      fmt::format("--domain: {} is in use by another run; choose another, or leave --domain away", wanted));
}

DomainClaim::~DomainClaim() {
  if (socket_ >= 0) close(socket_);
}

}  // namespace kilotwin::dds
