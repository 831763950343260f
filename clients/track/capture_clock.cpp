#include "clients/track/capture_clock.hpp"

#include <algorithm>
#include <chrono>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "core/os/files.hpp"

namespace kilotwin::track {
namespace {

/// Stamps that are older, or in the future, are of another clock.
constexpr std::int64_t kOldest_ns = 2'000'000'000;

template <class Clock> std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now().time_since_epoch()).count();
}

}  // namespace

StampedPicture read_stamped(const std::filesystem::path& file) {
  const std::optional<std::string> content = os::read_if_there(file);
  if (!content || content->empty()) return {};
  // OpenCV takes the octets as they are; it does not write them.
  const cv::Mat octets(1, static_cast<int>(content->size()), CV_8UC1, const_cast<char*>(content->data()));
  return {cv::imdecode(octets, cv::IMREAD_COLOR), cameras::stamp_of(*content)};
}

void CaptureClock::time(CapturedFrame& frame, const std::optional<cameras::FrameStamp>& stamp) {
  frame.capture_ns = now_ns<std::chrono::steady_clock>();
  if (stamp) {
    const std::int64_t age_ns = now_ns<std::chrono::system_clock>() - stamp->capture_ns;
    if (age_ns >= 0 && age_ns <= kOldest_ns) frame.capture_ns -= age_ns;
  }
  if (stamp && stamp_ && stamp->run == stamp_->run && stamp->simulated_s >= stamp_->simulated_s) {
    time_s_ += stamp->simulated_s - stamp_->simulated_s;
  } else if (capture_ns_) {
    time_s_ += 1e-9 * static_cast<double>(std::max<std::int64_t>(0, frame.capture_ns - *capture_ns_));
  }
  frame.time_s = time_s_;
  stamp_ = stamp;
  capture_ns_ = frame.capture_ns;
}

}  // namespace kilotwin::track
