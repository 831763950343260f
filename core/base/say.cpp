#include "core/base/say.hpp"

#include <cstdio>

namespace kilotwin {

void say(const std::string& line) {
  // One call, so that lines of several threads or processes do not mix.
  const std::string whole = line + '\n';
  static_cast<void>(std::fwrite(whole.data(), 1, whole.size(), stderr));
}

}  // namespace kilotwin
