#include "clients/track/identification.hpp"

#include <algorithm>

namespace kilotwin::track {
namespace {

constexpr std::uint8_t kIdentifyAtRunTime = 119, kIdentify = 120;
constexpr std::uint16_t kEnd = 0xffff;
/// One robot alone is blue for so many frames and so long: the robot asked before may still be blue, and this one not yet.
constexpr int kFrames = 4;
constexpr double kAlone_s = 0.2;

bool is_in_sight(const TrackedRobot& robot) { return robot.led_known && robot.state != TrackState::kLost; }

}  // namespace

std::optional<Question> question_of(double time_s, std::uint8_t type, std::uint8_t high, std::uint8_t low) {
  if (type != kIdentify && type != kIdentifyAtRunTime) return std::nullopt;
  Question question{time_s, std::nullopt};
  const auto number = static_cast<std::uint16_t>(high << 8 | low);
  if (number != kEnd) question.number = number;
  return question;
}

void Identification::take(const Question& question) {
  if (!question.number) {
    close();
    if (!begins_anew_) ++ended_;
    begins_anew_ = true;
    return;
  }
  if (asked_ && asked_->number == *question.number) return;
  close();
  if (begins_anew_) {
    answered_.clear();
    missing_.clear();
    doubtful_.clear();
    begins_anew_ = false;
  }
  asked_ = Asked{};
  asked_->number = *question.number;
  asked_->since_s = question.time_s;
}

/// The time for the answer is over.
void Identification::close() {
  if (!asked_) return;
  if (!asked_->is_settled) (asked_->several ? doubtful_ : missing_).insert(asked_->number);
  asked_.reset();
}

void Identification::take(double time_s, std::vector<TrackedRobot>& robots, Follower& follower) {
  if (asked_ && !asked_->is_settled && time_s >= asked_->since_s) watch(time_s, robots, follower);
  // Tracks that were given up take their numbers with them.
  std::erase_if(numbers_, [&](const auto& entry) {
    return std::none_of(robots.begin(), robots.end(),
                        [&](const TrackedRobot& robot) { return robot.track == entry.first; });
  });
  for (TrackedRobot& robot : robots) robot.number = number_of(robot.track);
}

void Identification::watch(double time_s, const std::vector<TrackedRobot>& robots, Follower& follower) {
  std::optional<std::uint32_t> blue;
  int blues = 0;
  for (const TrackedRobot& robot : robots) {
    if (!is_in_sight(robot)) continue;
    if (robot.led != Led::kBlue) {
      asked_->were_not_blue.insert(robot.track);
      continue;
    }
    ++blues;
    blue = robot.track;
  }
  asked_->several = blues > 1;
  const bool answers = blues == 1 && asked_->were_not_blue.contains(*blue);
  if (!answers || asked_->answer != blue) {
    asked_->answer = answers ? blue : std::nullopt;
    asked_->answers_since_s = time_s;
    asked_->frames = 0;
  }
  if (answers && ++asked_->frames >= kFrames && time_s - asked_->answers_since_s >= kAlone_s)
    settle(*blue, follower);
}

void Identification::settle(std::uint32_t track, Follower& follower) {
  asked_->is_settled = true;
  const std::uint16_t number = asked_->number;
  const auto before = answered_.find(track);
  if (before != answered_.end() && before->second != number) {
    // A robot has one number: it is not known which of the two.
    doubtful_.insert({number, before->second});
    numbers_.erase(track);
    return;
  }
  std::erase_if(numbers_, [&](const auto& entry) { return entry.second == number; });
  numbers_[track] = number;
  answered_[track] = number;
  follower.clear_doubt(track);
}

std::optional<std::uint16_t> Identification::number_of(std::uint32_t track) const {
  const auto found = numbers_.find(track);
  if (found == numbers_.end()) return std::nullopt;
  return found->second;
}

}  // namespace kilotwin::track
