#include "services/behaviours/sha256.hpp"

#include <openssl/evp.h>

#include <array>

#include "core/base/error.hpp"

namespace kilotwin::behaviours {

std::string sha256_hex(std::string_view data) {
  std::array<unsigned char, 32> digest{};
  KILOTWIN_DEMAND(EVP_Digest(data.data(), data.size(), digest.data(), nullptr, EVP_sha256(), nullptr) == 1);
  std::string hex;
  for (const unsigned octet : digest) {
    hex += "0123456789abcdef"[octet >> 4];
    hex += "0123456789abcdef"[octet & 15];
  }
  return hex;
}

}  // namespace kilotwin::behaviours
