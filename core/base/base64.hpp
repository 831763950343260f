/// Base64 (RFC 4648, section 4), for pictures in pages and schemas in JSON.
#pragma once

#include <string>
#include <string_view>

namespace kilotwin {

[[nodiscard]] std::string base64(std::string_view octets);

}  // namespace kilotwin
