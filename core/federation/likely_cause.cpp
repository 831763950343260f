#include "core/federation/likely_cause.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace kilotwin {

std::string likely_cause(const dds::Transport& transport, std::uint32_t heard, std::uint32_t federates) {
  if (heard >= federates) {
    return fmt::format(
        "all {} services were heard, but frames do not come through; the link may be too slow, or drop UDP "
        "datagrams of "
        "64 kB",
        federates);
  }
  const std::uint32_t first_port = 7400 + 250 * transport.domain;
  const std::string where =
      transport.peers.empty()
          ? "without --peer only services of this machine meet; where there are several machines, give every "
            "service "
            "the address of each with --peer"
          : fmt::format(
                "this service looks for others at {}; every service needs the address of each machine, its own "
                "included, with --peer",
                fmt::join(transport.peers, ", "));
  return fmt::format(
      "{} of {} services were heard on DDS domain {}; start the missing ones with the same --run and --domain; {}; "
      "firewalls must pass UDP ports {} to {}",
      heard, federates, transport.domain, where, first_port, first_port + 249);
}

}  // namespace kilotwin
