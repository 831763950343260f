#pragma once

#include <string>
#include <string_view>

namespace kilotwin::behaviours {

/// SHA-256 of the octets of `data`: 64 lower-case hexadecimal digits.
[[nodiscard]] std::string sha256_hex(std::string_view data);

}  // namespace kilotwin::behaviours
