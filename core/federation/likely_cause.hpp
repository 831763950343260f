/// Explains why federates may fail to discover each other.
#pragma once

#include <cstdint>
#include <string>

#include "core/dds/dds.hpp"

namespace kilotwin {

/// One line without a full stop. `heard`: number of the run's `federates` that were heard so far, including this one.
[[nodiscard]] std::string likely_cause(const dds::Transport&, std::uint32_t heard, std::uint32_t federates);

}  // namespace kilotwin
