/// UTF-8 of texts that come from programs and may be anything.
#pragma once

#include <string>
#include <string_view>

namespace kilotwin::recorder {

/// UTF-8 as code points; a malformed octet becomes U+FFFD.
[[nodiscard]] std::u32string code_points(std::string_view text);
/// The text with malformed octets replaced by U+FFFD.
[[nodiscard]] std::string valid_utf8(std::string_view text);

}  // namespace kilotwin::recorder
