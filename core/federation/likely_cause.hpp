/// Why federates may fail to meet, in words for people.
#pragma once

#include <cstdint>
#include <string>

#include "core/dds/dds.hpp"

namespace kilotwin {

/// One line, without a full stop. `heard`: how many of the run's `federates` were heard so far, the own one included.
[[nodiscard]] std::string likely_cause(const dds::Transport&, std::uint32_t heard, std::uint32_t federates);

}  // namespace kilotwin
