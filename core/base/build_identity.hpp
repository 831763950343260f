/// Identity of this build of Kilotwin. Builds of the same identity give the same results for the same run; builds of
/// different identities must not take part in one run. cmake/BuildIdentity.cmake defines what the identity covers.
#pragma once

#include <string_view>

namespace kilotwin {

/// "VERSION-HASH": the project's version, and 16 hex digits of the hash of its sources and compiler.
[[nodiscard]] std::string_view build_identity();
/// The compiler's name and version, e.g. "GNU 12.2.0".
[[nodiscard]] std::string_view build_compiler();

}  // namespace kilotwin
