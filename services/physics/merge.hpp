/// Merges several lists into ascending order of robot ids, by a bit and an entry per robot of the swarm, without
/// comparisons: O(entries + robots / 64).
#pragma once

#include <bit>
#include <cstdint>
#include <vector>

namespace kilotwin::physics {

class Merge {
 public:
  struct Entry {
    std::uint32_t list, index;
  };

  explicit Merge(std::uint32_t robots) : marks_(robots / 64 + 1, 0), entry_(robots) {}

  /// Returns false and changes nothing if the robot was added already.
  [[nodiscard]] bool add(std::uint32_t robot, Entry entry) {
    std::uint64_t& marks = marks_[robot / 64];
    const std::uint64_t mark = std::uint64_t{1} << robot % 64;
    if ((marks & mark) != 0) return false;
    marks |= mark;
    entry_[robot] = entry;
    ++size_;
    return true;
  }
  [[nodiscard]] std::size_t size() const { return size_; }

  /// Calls take(robot, entry) in ascending order, then clears the list.
  template <class Take> void drain(Take&& take) {
    for (std::uint32_t word = 0; word < marks_.size(); ++word) {
      for (std::uint64_t left = marks_[word]; left != 0; left &= left - 1) {
        const std::uint32_t robot = word * 64 + static_cast<std::uint32_t>(std::countr_zero(left));
        take(robot, entry_[robot]);
      }
      marks_[word] = 0;
    }
    size_ = 0;
  }

 private:
  std::vector<std::uint64_t> marks_;
  std::vector<Entry> entry_;
  std::size_t size_ = 0;
};

}  // namespace kilotwin::physics
