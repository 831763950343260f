/// When a session that waits says for whom it waits, and when it adds the likely cause.
#pragma once

#include <chrono>

namespace kilotwin {

class WaitReport {
 public:
  using Clock = std::chrono::steady_clock;
  /// The first line comes after a second, further ones every five, the likely cause once after a minute without progress.
  static constexpr std::chrono::milliseconds kAfter{1000}, kEvery{5000}, kCauseAfter{60'000};
  enum class Due { kNothing, kWhom, kWhomAndCause };

  explicit WaitReport(Clock::time_point now) : since_(now), next_(now + kAfter) {}
  /// The run has come on, though the wait lasts. Lines come no more often for that.
  void progress(Clock::time_point now) {
    since_ = now;
    cause_given_ = false;
  }
  /// The report that is due now. It counts as printed.
  [[nodiscard]] Due due(Clock::time_point now) {
    if (now < next_) return Due::kNothing;
    next_ = now + kEvery;
    if (cause_given_ || now - since_ < kCauseAfter) return Due::kWhom;
    cause_given_ = true;
    return Due::kWhomAndCause;
  }
  /// Since the last progress.
  [[nodiscard]] Clock::duration waited(Clock::time_point now) const { return now - since_; }

 private:
  Clock::time_point since_, next_;
  bool cause_given_ = false;
};

}  // namespace kilotwin
