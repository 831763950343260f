/// Counts what a door passed on and what it left out, and says so in one line.
#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace kilotwin::doors {

class Tally {
 public:
  void passed(std::size_t robots) {
    ++frames_;
    poses_ += robots;
  }
  /// Counts one sample that is left out. `reason` completes "left out: N ..."; `example` shows the first of them. Returns
  /// whether it is the first for this reason.
  bool left_out(const std::string& reason, const std::string& example = {});
  [[nodiscard]] std::uint64_t frames() const { return frames_; }
  [[nodiscard]] std::uint64_t poses() const { return poses_; }
  [[nodiscard]] std::uint64_t left_out_for(const std::string& reason) const;
  /// "1200 frames with 12000 poses; left out: 3 of names that mean no tracked robot (the first: "wand")".
  [[nodiscard]] std::string in_words() const;

 private:
  struct Count {
    std::uint64_t times = 0;
    std::string example;
  };
  std::uint64_t frames_ = 0, poses_ = 0;
  std::map<std::string, Count> left_out_;
};

}  // namespace kilotwin::doors
