/// Finds the robot of each track: ARK's identification. The station broadcasts a number; the robot of that number turns its LED
/// blue, all others another colour. docs/explanation/camera-tracker.md has the rule. Pure: questions and frames in, numbers out.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "clients/track/tracker.hpp"

namespace kilotwin::track {

/// A broadcast of the station, as far as it is of identification.
struct Question {
  double time_s = 0;                    ///< when it leaves, on the clock of the frames
  std::optional<std::uint16_t> number;  ///< the robot that is asked; nothing: the identification ends
};

/// The question of a broadcast of ARK's types 119 and 120: the number in two octets, the high one first, and 0xFFFF at the end.
/// Nothing for other types.
[[nodiscard]] std::optional<Question> question_of(double time_s, std::uint8_t type, std::uint8_t high,
                                                  std::uint8_t low);

class Identification {
 public:
  /// Questions come in the order of their times. One that repeats the number before it changes nothing.
  void take(const Question& question);
  /// The robots of a frame. Writes their numbers into them; robots that have one and are in doubt come out of it when they
  /// answer. Frames come in the order of their times, and after the questions before them.
  void take(double time_s, std::vector<TrackedRobot>& robots, Follower& follower);

  [[nodiscard]] std::optional<std::uint16_t> number_of(std::uint32_t track) const;
  [[nodiscard]] std::size_t identified() const { return numbers_.size(); }
  /// Numbers that were asked since the last end: nobody answered, or several did.
  [[nodiscard]] const std::set<std::uint16_t>& missing() const { return missing_; }
  [[nodiscard]] const std::set<std::uint16_t>& doubtful() const { return doubtful_; }
  /// How often an identification ended.
  [[nodiscard]] std::uint64_t ended() const { return ended_; }

 private:
  struct Asked {
    std::uint16_t number = 0;
    double since_s = 0;
    /// Tracks whose LED was not blue since the question: only they can answer by turning blue.
    std::set<std::uint32_t> were_not_blue;
    std::optional<std::uint32_t> answer;  ///< the one track that is blue
    double answers_since_s = 0;
    int frames = 0;           ///< in which it is the only one
    bool several = false;     ///< were blue in the last frame
    bool is_settled = false;  ///< the answer was taken
  };

  void watch(double time_s, const std::vector<TrackedRobot>& robots, Follower& follower);
  void settle(std::uint32_t track, Follower& follower);
  void close();

  std::optional<Asked> asked_;
  std::map<std::uint32_t, std::uint16_t> numbers_;   ///< by track
  std::map<std::uint32_t, std::uint16_t> answered_;  ///< in the identification under way
  std::set<std::uint16_t> missing_, doubtful_;
  bool begins_anew_ = true;
  std::uint64_t ended_ = 0;
};

}  // namespace kilotwin::track
