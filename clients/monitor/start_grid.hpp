/// Instants at which a change of the model may have begun. New ones come at a fixed interval and are thinned with their age, so
/// that a fixed number covers a long time.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "core/base/time.hpp"

namespace kilotwin::monitor {

class StartGrid {
 public:
  static constexpr std::size_t kSlots = 16;
  /// A start every `every` ticks; a start of an age beyond `oldest` ticks is dropped first.
  StartGrid(std::int64_t every, std::int64_t oldest) : every_(every), oldest_(oldest) {}

  /// Returns the slot that begins at `now`, if one does; its earlier content is to be cleared. Ticks ascend.
  std::optional<std::size_t> advance(Tick now);

  [[nodiscard]] std::int64_t every() const { return every_; }
  [[nodiscard]] bool is_used(std::size_t slot) const { return begin_[slot].has_value(); }
  /// The slot must be used.
  [[nodiscard]] Tick begin(std::size_t slot) const { return *begin_[slot]; }

 private:
  [[nodiscard]] std::size_t slot_to_reuse(Tick now) const;

  std::int64_t every_, oldest_;
  std::array<std::optional<Tick>, kSlots> begin_{};
};

}  // namespace kilotwin::monitor
