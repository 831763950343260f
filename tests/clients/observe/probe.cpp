// Observes a domain until it is killed, and says when the first state has come. A test stalls it. Usage: observe_probe DOMAIN
#include <cstdlib>

#include "clients/observe/observer.hpp"
#include "core/base/say.hpp"

int main(int count, char** words) {
  using namespace kilotwin;
  if (count != 2) return 2;
  observe::Observer observer({static_cast<std::uint32_t>(std::strtoul(words[1], nullptr, 10)), {}});
  bool seen = false;
  for (;;) {
    if (observer.wait(std::chrono::milliseconds(100)) == observe::News::kState && !seen) {
      seen = true;
      say("probe: sees the run");
    }
  }
}
