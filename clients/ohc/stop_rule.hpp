/// When the controller of real robots gets a STOP that nobody sent: the run has ended, or its station has fallen silent. Otherwise
/// the robots would go on with their last command.
#pragma once

#include <chrono>
#include <optional>

namespace kilotwin::ohc {

class StopRule {
 public:
  using Time = std::chrono::steady_clock::time_point;
  /// The station promises some 5 statuses a second.
  static constexpr std::chrono::milliseconds kLongestSilence{1000};
  /// Time between two looks. STOP is therefore decided at most 1.1 s after the last status; with a page and the STOP itself on the
  /// line, the controller has it within 1.3 s.
  static constexpr std::chrono::milliseconds kLook{100};

  enum class News : unsigned char { kNone, kSilent, kBack };
  struct Verdict {
    bool stop = false;        ///< to be sent now
    News news = News::kNone;  ///< of the station
  };

  /// `heard`: when the last status of the run on the domain came; nothing where there is no run.
  [[nodiscard]] Verdict look(std::optional<Time> heard, Time now) {
    const bool silent = heard && now - *heard > kLongestSilence;
    const bool lives = heard && !silent;
    Verdict verdict;
    verdict.stop = driven_ && !lives;
    if (silent && !silent_) verdict.news = News::kSilent;
    if (silent_ && lives) verdict.news = News::kBack;
    driven_ = lives;
    silent_ = silent;
    return verdict;
  }
  /// A packet of the station went to the controller. STOP must follow, even if the run ends before the next look, or the packet
  /// came late from a station that is silent.
  void forwarded() { driven_ = true; }

 private:
  bool driven_ = false;  ///< the controller may repeat a packet
  bool silent_ = false;
};

}  // namespace kilotwin::ohc
