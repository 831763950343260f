/// LiveTopics: the runs on a domain, one after the other, as topics of a server.
#pragma once

#include <optional>

#include "clients/foxglove/server/server.hpp"
#include "clients/observe/observer.hpp"

namespace kilotwin::foxglove {

class LiveTopics {
 public:
  LiveTopics(const dds::Transport& transport, Server& server) : observer_(transport), server_(server) {}

  /// Looks at the domain for up to 50 ms and passes on what is new. Call it again and again.
  void serve();

 private:
  void begin();
  void write_state();

  observe::Observer observer_;
  Server& server_;
  std::optional<Topics> topics_;  ///< of the run at hand, if it can be shown
  Time_ns time_ = 0;
};

}  // namespace kilotwin::foxglove
