/// A DDS domain that no test beside this one takes.
#pragma once

#include <string>

#include "core/dds/dds.hpp"

namespace kilotwin::test {

/// A claim would keep the test's own run out. So a participant replaces it: DomainClaim::any() passes over its domain.
struct OwnDomain {
  explicit OwnDomain(const dds::DomainClaim& claim = dds::DomainClaim::any())
      : number(claim.domain()), name(std::to_string(number)), participant({number, {}}) {}
  const std::uint32_t number;
  const std::string name;
  const dds::Participant participant;
};

}  // namespace kilotwin::test
