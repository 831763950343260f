/// Assignment of unique numbers, as the real station does it, to robots whose numbers are unknown or not unique. Each robot draws
/// a temporary number and shows it digit by digit by its LED, all robots at once. The station reads the digits, sets the number
/// of each robot whose temporary number is unique, and lets the others draw again.
///
/// Broadcasts: 10 the method, 0 binary with 11 digits, 1 base 3 with 8 digits; 1 draw a temporary number; 4 show the digit with
/// this index, the lowest first (0 red, 1 blue, 2 green); 5 confirm: the robot of this temporary number turns blue, others
/// red; 2 set: temporary number, new number; 3 robots without a number draw again. Numbers take two octets, the high one
/// first. Then every number is verified as identify.cpp does. The robots' program: behaviours/housekeeping.c.
///
/// Parameters: base (2), digit_s (2), rounds (8). The track that the station follows as i gets the number i.
#include <kilotwin_station.hpp>

namespace {

constexpr std::uint8_t kDraw = 1, kSet = 2, kRetry = 3, kDigit = 4, kConfirm = 5, kMethod = 10, kVerify = 120;
constexpr unsigned kEnd = 0xffff;
constexpr double kStart_s = 1, kRepeat_s = 0.5, kShort_s = 1.2;

std::vector<std::uint8_t> octets(std::initializer_list<unsigned> numbers) {
  std::vector<std::uint8_t> data;
  for (const unsigned number : numbers) {
    data.push_back(static_cast<std::uint8_t>(number >> 8));
    data.push_back(static_cast<std::uint8_t>(number & 255));
  }
  return data;
}

class Assignment : public KilobotExperiment {
 public:
  void initialise(bool /*isResume*/) override {
    const double base = parameter("base", 2);
    if (base != 2 && base != 3) throw std::runtime_error("base takes 2 or 3");
    base_ = static_cast<unsigned>(base);
    digits_ = base_ == 2 ? 11 : 8;
    digit_s_ = parameter("digit_s", 2);
    rounds_ = static_cast<std::uint32_t>(parameter("rounds", 8));
    colours_.assign(robots(), OFF);
    temporary_.assign(robots(), -1);
    assigned_.assign(robots(), 0);
    verified_.assign(robots(), 0);
  }
  void updateKilobotState(Kilobot kilobot) override {
    colours_[kilobot.getID()] = kilobot.isSeen() ? kilobot.getLedColour() : OFF;
  }
  void run() override {
    updateKilobotStates();
    if (time < kStart_s) return;
    if (phase_ == Phase::kBegin) return enter(Phase::kChooseMethod);
    if (time - entered_at_s_ >= length_s()) return leave();
    // Repeated, as a copy may be lost; drawing again would change what was drawn.
    const bool repeatable = phase_ != Phase::kDrawing;
    if (repeatable && time - sent_at_s_ >= kRepeat_s) send();
  }
  void serialize(Archive& archive) override {
    archive& phase_& entered_at_s_& sent_at_s_& index_& round_& temporary_& assigned_& verified_;
  }
  [[nodiscard]] std::uint64_t word() override {
    return static_cast<std::uint64_t>(phase_) << 40 | std::uint64_t{round_} << 32 | index_;
  }
  [[nodiscard]] std::string logState(Kilobot kilobot) override {
    return std::to_string(temporary_[kilobot.getID()]) + '\t' + std::to_string(assigned_[kilobot.getID()]);
  }

 private:
  enum class Phase : std::uint8_t {
    kBegin,
    kChooseMethod,
    kDrawing,
    kReading,
    kConfirming,
    kSetting,
    kVerifying,
    kDone
  };

  [[nodiscard]] double length_s() const { return phase_ == Phase::kReading ? digit_s_ : kShort_s; }

  void enter(Phase phase) {
    phase_ = phase;
    entered_at_s_ = time;
    send();
  }
  void send() {
    sent_at_s_ = time;
    const auto temporary = static_cast<unsigned>(index_ < robots() ? temporary_[index_] : 0);
    switch (phase_) {
      case Phase::kChooseMethod: return broadcastMessage({kMethod, {static_cast<std::uint8_t>(base_ - 2)}});
      case Phase::kDrawing: return broadcastMessage({round_ == 0 ? kDraw : kRetry, {}});
      case Phase::kReading: return broadcastMessage({kDigit, {static_cast<std::uint8_t>(index_)}});
      case Phase::kConfirming: return broadcastMessage({kConfirm, octets({temporary})});
      case Phase::kSetting: return broadcastMessage({kSet, octets({temporary, index_})});
      case Phase::kVerifying: return broadcastMessage({kVerify, octets({index_})});
      default: return;
    }
  }
  void leave() {
    switch (phase_) {
      case Phase::kChooseMethod: return draw();
      case Phase::kDrawing: index_ = 0; return enter(Phase::kReading);
      case Phase::kReading:
        read_digit();
        if (++index_ < digits_) return enter(Phase::kReading);
        return next_to_confirm(0);
      case Phase::kConfirming:
        if (only_blue() == static_cast<std::int64_t>(index_)) return enter(Phase::kSetting);
        return next_to_confirm(index_ + 1);
      case Phase::kSetting: assigned_[index_] = 1; return next_to_confirm(index_ + 1);
      case Phase::kVerifying:
        verified_[index_] = only_blue() == static_cast<std::int64_t>(index_) ? 1 : 0;
        if (++index_ < robots()) return enter(Phase::kVerifying);
        return finish();
      default: return;
    }
  }
  void draw() {
    for (std::uint32_t track = 0; track < robots(); ++track) temporary_[track] = assigned_[track] != 0 ? -1 : 0;
    enter(Phase::kDrawing);
  }
  /// RED 0, BLUE 1, GREEN 2; a track without a readable digit is left for another round.
  void read_digit() {
    unsigned weight = 1;
    for (std::uint32_t i = 0; i < index_; ++i) weight *= base_;
    for (std::uint32_t track = 0; track < robots(); ++track) {
      if (temporary_[track] < 0) continue;
      const int digit = colours_[track] == RED     ? 0
                        : colours_[track] == BLUE  ? 1
                        : colours_[track] == GREEN ? 2
                                                   : -1;
      if (digit < 0 || digit >= static_cast<int>(base_))
        temporary_[track] = -1;
      else
        temporary_[track] += digit * static_cast<int>(weight);
    }
  }
  [[nodiscard]] bool is_unique(std::uint32_t track) const {
    std::uint32_t count = 0;
    for (const std::int32_t other : temporary_) count += other == temporary_[track] ? 1u : 0u;
    return count == 1;
  }
  /// The first track from `track` on whose number can be set; else the next round, or the verification.
  void next_to_confirm(std::uint32_t track) {
    for (index_ = track; index_ < robots(); ++index_) {
      if (assigned_[index_] == 0 && temporary_[index_] >= 0 && is_unique(index_)) return enter(Phase::kConfirming);
    }
    bool all = true;
    for (const std::uint8_t assigned : assigned_) all = all && assigned != 0;
    ++round_;
    if (!all && round_ < rounds_) return draw();
    index_ = 0;
    enter(Phase::kVerifying);
  }
  /// The one track whose LED is blue; -1: none, or several.
  [[nodiscard]] std::int64_t only_blue() const {
    std::int64_t found = -1;
    for (std::uint32_t track = 0; track < robots(); ++track) {
      if (colours_[track] != BLUE) continue;
      if (found >= 0) return -1;
      found = track;
    }
    return found;
  }
  void finish() {
    phase_ = Phase::kDone;
    broadcastMessage({kVerify, octets({kEnd})});
    std::uint32_t assigned = 0, verified = 0;
    for (std::uint32_t track = 0; track < robots(); ++track) {
      assigned += assigned_[track];
      verified += verified_[track];
    }
    report("{\"procedure\": \"assign_ids\", \"robots\": " + std::to_string(robots()) +
               ", \"base\": " + std::to_string(base_) + ", \"rounds\": " + std::to_string(round_) +
               ", \"assigned\": " + std::to_string(assigned) + ", \"verified\": " + std::to_string(verified) +
               ", \"seconds\": " + std::to_string(time) + "}",
           "assignment of numbers: " + std::to_string(assigned) + " of " + std::to_string(robots()) + " set, " +
               std::to_string(verified) + " verified, " + std::to_string(round_) + " rounds");
    experimentComplete();
  }

  unsigned base_ = 2, digits_ = 11;
  double digit_s_ = 2;
  std::uint32_t rounds_ = 0;
  Phase phase_ = Phase::kBegin;
  double entered_at_s_ = 0, sent_at_s_ = 0;
  std::uint32_t index_ = 0;  ///< of the digit, or the track at hand
  std::uint32_t round_ = 0;
  std::vector<lightColour> colours_;
  std::vector<std::int32_t> temporary_;  ///< -1: unreadable, or it has a number
  std::vector<std::uint8_t> assigned_, verified_;
};

}  // namespace

extern "C" KilobotExperiment* createExpt() { return new Assignment; }
