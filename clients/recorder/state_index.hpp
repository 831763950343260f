/// StateIndex: where the states, floors, variables and inputs of a recording lie in its file. It reads the first octets of each
/// record and checks the checksum of its length; Reader checks the record itself. A recording may grow meanwhile: update()
/// continues.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "core/os/descriptor.hpp"

namespace kilotwin::recorder {

class StateIndex {
 public:
  struct Entry {
    std::int64_t tick = 0;
    std::uint64_t offset = 0;  ///< of the record's frame in the file, for Reader::go_to()
  };

  /// Throws UserError if the file cannot be opened. Reads nothing yet.
  explicit StateIndex(const std::filesystem::path& file);

  /// Reads on until the end of the file, or until a damaged frame. Returns whether there are new records.
  bool update();

  /// Ticks ascend.
  [[nodiscard]] const std::vector<Entry>& states() const { return states_; }
  /// In the order of the file.
  [[nodiscard]] const std::vector<Entry>& floors() const { return floors_; }
  /// Values of one variable, by its index in the header. Ticks ascend; several hosts may have one record each per tick.
  [[nodiscard]] const std::vector<Entry>& variable(std::size_t index) const;
  /// Events of one kind, a number of proto::RecordedEvent. Ticks ascend.
  [[nodiscard]] const std::vector<Entry>& events(std::size_t kind) const;
  /// Samples of trackers. Ticks ascend.
  [[nodiscard]] const std::vector<Entry>& trackers() const { return trackers_; }
  /// Inputs, in the order of the file.
  [[nodiscard]] const std::vector<Entry>& inputs() const { return inputs_; }
  /// The counts of all radios, and of messages per pair; near the end of the file.
  [[nodiscard]] std::optional<std::uint64_t> radio() const { return radio_; }
  [[nodiscard]] std::optional<std::uint64_t> messages() const { return messages_; }
  /// The end mark was reached.
  [[nodiscard]] bool ended() const { return ended_; }

  /// Position of the last state at or before `tick`; 0 if all states are later. There must be a state.
  [[nodiscard]] std::size_t at_or_before(std::int64_t tick) const;

 private:
  [[nodiscard]] bool take_record(std::uint64_t size);

  os::Descriptor file_;
  std::uint64_t offset_ = 0;  // of the next frame
  std::vector<Entry> states_, floors_, trackers_, inputs_;
  std::vector<std::vector<Entry>> variables_, events_;
  std::optional<std::uint64_t> radio_, messages_;
  bool ended_ = false;
};

}  // namespace kilotwin::recorder
