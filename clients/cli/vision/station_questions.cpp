#include "clients/cli/vision/station_questions.hpp"

#include <algorithm>
#include <chrono>

#include "core/frames/overhead_packet.hpp"

namespace kilotwin::cli {

StationQuestions::StationQuestions(const dds::Participant& participant)
    : reader_(participant, topics::station_packets(),
              [this](const PublicStationPacket& packet, dds::SampleState state) {
                if (state.valid) receive(packet);
              }) {}

void StationQuestions::receive(const PublicStationPacket& packet) {
  constexpr std::size_t kMost = 1024;
  constexpr double kLongestOffset_s = 1.0;
  const auto command = static_cast<OverheadCommand>(packet.command);
  const bool is_message =
      command == OverheadCommand::kRepeat || command == OverheadCommand::kRaw || command == OverheadCommand::kOnce;
  if (!is_message) return;
  if (!(packet.offset_s >= 0 && packet.offset_s < kLongestOffset_s)) return;
  const double now_s = std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  const auto question =
      track::question_of(now_s + packet.offset_s, packet.message[9], packet.message[0], packet.message[1]);
  if (!question) return;
  const std::lock_guard lock(mutex_);
  waiting_.push_back(*question);
  if (waiting_.size() > kMost) waiting_.pop_front();
}

std::vector<track::Question> StationQuestions::until(std::int64_t now_ns) {
  const double now_s = 1e-9 * static_cast<double>(now_ns);
  std::vector<track::Question> due;
  const std::lock_guard lock(mutex_);
  while (!waiting_.empty() && waiting_.front().time_s <= now_s) {
    due.push_back(waiting_.front());
    waiting_.pop_front();
  }
  return due;
}

}  // namespace kilotwin::cli
