/// OrderedRecords: states, variables and events of a recording, tick by tick. In the file, variables and events of a federated run
/// may come after later states.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "clients/recorder/reader.hpp"

namespace kilotwin::recorder {

/// All of one tick.
struct TickRecords {
  std::optional<proto::StateRecord> state;
  std::vector<proto::VariableRecord> variables;
  std::vector<proto::EventRecord> events;
};

class OrderedRecords {
 public:
  static constexpr unsigned kStates = 1, kVariables = 2, kEvents = 4;
  /// `kinds`: those that are wanted.
  OrderedRecords(Reader& recording, unsigned kinds) : recording_(recording), kinds_(kinds) {}

  /// Advances to the next tick of which there is something. False at the end.
  [[nodiscard]] bool next();
  [[nodiscard]] Tick tick() const { return tick_; }
  /// Valid until the next call of next().
  [[nodiscard]] const TickRecords& records() const { return records_; }

 private:
  void take(const proto::Record& record);

  Reader& recording_;
  const unsigned kinds_;
  std::map<std::int64_t, TickRecords> waiting_;
  std::int64_t complete_before_ = -1;  ///< nothing of earlier ticks comes any more
  bool ended_ = false;
  Tick tick_{-1};
  TickRecords records_;
};

}  // namespace kilotwin::recorder
