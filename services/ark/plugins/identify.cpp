/// Identification, as the real station does it: which robot that the tracker follows has which number? The station broadcasts
/// each number in turn, type 120 with the number in two octets, the high one first. The robot of that number turns its LED blue,
/// all others red. 0xFFFF ends it. The robots' program: behaviours/housekeeping.c.
///
/// Parameters: first_id (0), ids (as many as robots), wait_s (1.5), the time for LEDs to change and to be seen.
/// Report: `identified`, `missing` numbers, `doubtful` numbers that several robots answered, and `id_of_track`.
#include <kilotwin_station.hpp>

namespace {

constexpr std::uint8_t kIdentify = 120;
constexpr unsigned kEnd = 0xffff;
constexpr double kRepeat_s = 0.5;

class Identification : public KilobotExperiment {
 public:
  void initialise(bool /*isResume*/) override {
    first_ = static_cast<std::uint32_t>(parameter("first_id", 0));
    ids_ = static_cast<std::uint32_t>(parameter("ids", robots()));
    wait_s_ = parameter("wait_s", 1.5);
    if (wait_s_ <= kRepeat_s) throw std::runtime_error("wait_s is at most 0.5 s; LEDs take longer to be seen");
    colours_.assign(robots(), OFF);
    id_of_track_.assign(robots(), -1);
  }
  void updateKilobotState(Kilobot kilobot) override {
    colours_[kilobot.getID()] = kilobot.isSeen() ? kilobot.getLedColour() : OFF;
  }
  void run() override {
    updateKilobotStates();
    constexpr double kStart_s = 1;  // robots start by the station's RUN
    if (time < kStart_s) return;
    if (asked_at_s_ >= 0 && time - asked_at_s_ >= wait_s_) evaluate();
    if (next_ == ids_) return finish();
    if (asked_at_s_ < 0) asked_at_s_ = time;
    if (sent_at_s_ < 0 || time - sent_at_s_ >= kRepeat_s) ask(first_ + next_);
  }
  void serialize(Archive& archive) override {
    archive& next_& asked_at_s_& sent_at_s_& id_of_track_& missing_& doubtful_;
  }
  [[nodiscard]] std::uint64_t word() override { return next_; }
  [[nodiscard]] std::string logState(Kilobot kilobot) override {
    return std::to_string(id_of_track_[kilobot.getID()]);
  }

 private:
  void ask(unsigned id) {
    broadcastMessage({kIdentify, {static_cast<std::uint8_t>(id >> 8), static_cast<std::uint8_t>(id & 255)}});
    sent_at_s_ = time;
  }
  void evaluate() {
    std::vector<std::uint32_t> blue;
    for (std::uint32_t track = 0; track < robots(); ++track) {
      if (colours_[track] == BLUE) blue.push_back(track);
    }
    const std::uint32_t id = first_ + next_;
    if (blue.empty()) missing_.push_back(id);
    if (blue.size() > 1) doubtful_.push_back(id);
    if (blue.size() == 1) id_of_track_[blue[0]] = static_cast<std::int32_t>(id);
    ++next_;
    asked_at_s_ = sent_at_s_ = -1;
  }
  void finish() {
    ask(kEnd);
    std::uint32_t identified = 0;
    for (const std::int32_t id : id_of_track_) identified += id >= 0 ? 1u : 0u;
    const auto list = [](const auto& values) {
      std::string text;
      for (const auto value : values) text += (text.empty() ? "" : ", ") + std::to_string(value);
      return "[" + text + "]";
    };
    report("{\"procedure\": \"identify\", \"robots\": " + std::to_string(robots()) +
               ", \"identified\": " + std::to_string(identified) + ", \"seconds\": " + std::to_string(time) +
               ", \"missing\": " + list(missing_) + ", \"doubtful\": " + list(doubtful_) +
               ", \"id_of_track\": " + list(id_of_track_) + "}",
           "identification: " + std::to_string(identified) + " of " + std::to_string(robots()) + " robots, " +
               std::to_string(missing_.size()) + " numbers missing, " + std::to_string(doubtful_.size()) +
               " doubtful");
    experimentComplete();
  }

  std::uint32_t first_ = 0, ids_ = 0, next_ = 0;
  double wait_s_ = 0, asked_at_s_ = -1, sent_at_s_ = -1;
  std::vector<lightColour> colours_;
  std::vector<std::int32_t> id_of_track_;  ///< -1: unknown
  std::vector<std::uint32_t> missing_, doubtful_;
};

}  // namespace

extern "C" KilobotExperiment* createExpt() { return new Identification; }
