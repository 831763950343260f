#include "services/ark/heard_input.hpp"

#include <algorithm>

#include "core/plan/tracking_settings.hpp"

namespace kilotwin::ark {
namespace {

/// Messages that may wait: those of a second in which 100 robots send ten each.
constexpr std::size_t kMostHeard = 1000;
constexpr float kFarthest_mm = 1e6F;

}  // namespace

HeardInput::HeardInput(const RunPlan& plan, const dds::Participant& participant)
    : plan_(plan),
      reader_(participant, topics::heard_messages(),
              [this](const PublicHeardMessage& sample, dds::SampleState state) {
                if (state.valid) on_message(sample);
              }) {}

void HeardInput::on_message(const PublicHeardMessage& sample) {
  if (sample.run != 0 && sample.run != plan_.run()) return;
  const auto is_tracked = [this](std::uint32_t robot) { return robot < plan_.robots() && plan_.tracked(robot); };
  HeardMessage message;
  if (is_tracked(sample.listener)) message.listener = sample.listener;
  if (is_tracked(sample.robot) && plan_.tracking_settings().says_heard(sample.robot)) {
    message.robot = sample.robot;
  } else if (sample.robot != HeardMessage::kUnknown || message.listener == HeardMessage::kUnknown) {
    return;
  }
  if (sample.distance_mm >= 0 && sample.distance_mm <= kFarthest_mm) message.distance_mm = sample.distance_mm;
  std::copy(std::begin(sample.message), std::end(sample.message), message.message.begin());
  const std::lock_guard lock(mutex_);
  waiting_.push_back(message);
  if (waiting_.size() > kMostHeard) waiting_.pop_front();
}

std::vector<HeardMessage> HeardInput::take() {
  const std::lock_guard lock(mutex_);
  std::vector<HeardMessage> messages(waiting_.begin(), waiting_.end());
  waiting_.clear();
  return messages;
}

}  // namespace kilotwin::ark
