/// Foraging as ARK demonstrates it (demonstration C of Reina et al. 2017): virtual food, a virtual home, and robots that carry
/// one load at a time. Meaning, units and defaults of the parameters: ForagingEnvironment in idl/experiment.proto.
///
/// Messages to a robot: 0 inside its goal; 1..13 outside, 1 within 100 mm of its centre and one more for every 100 mm; 14 that
/// it has changed its goal, with 0 to the home and 1 to the food; 15 that no food is left. The data of 0..13 is the bearing of
/// the goal's centre.
///
/// A robot asks by a LED of pure blue. One that asks within 30 mm of its goal gets a load there, or puts it down. It is told
/// so until it ceases to ask. (Distances and tolerance: the loop functions of ARK's demonstration in ARGoS.)
#include <kilotwin_station.hpp>

namespace {

constexpr std::uint8_t kInside = 0, kFarthest = 13, kSwap = 14, kNoFood = 15;
constexpr double kStep_mm = 100, kTolerance_mm = 30;
constexpr std::uint16_t kToHome = 0, kToFood = 1;

double squared(double x) { return x * x; }

class ForagingEnvironment : public KilobotEnvironment {
 public:
  Point home, food;
  double home_radius_mm = 0, food_radius_mm = 0;  ///< at the start
  double scent_radius_mm = 0;
  std::uint32_t loads = 0;  ///< at the start

  // State that changes during a run.
  std::uint32_t loads_left = 0, delivered = 0;
  std::vector<std::uint8_t> carries;  ///< per robot, 1: a load

  [[nodiscard]] double food_radius_now_mm() const { return food_radius_mm * loads_left / loads; }
  [[nodiscard]] double home_radius_now_mm() const { return home_radius_mm + food_radius_mm * delivered / loads; }

  void updateVirtualSensor(Kilobot kilobot) override {
    if (!kilobot.isSeen()) return;
    std::uint8_t& load = carries[kilobot.getID()];
    if (kilobot.getLedColour() == BLUE) {
      if (load != 0 && is_within(kilobot, true, kTolerance_mm)) {
        load = 0;
        ++delivered;
        return swap(kilobot);
      }
      if (load == 0 && loads_left > 0 && is_within(kilobot, false, kTolerance_mm)) {
        load = 1;
        --loads_left;
        return swap(kilobot);
      }
      // It stands where it was told to change, and has not heard it.
      if (is_within(kilobot, load == 0, kTolerance_mm)) return swap(kilobot);
    }
    if (load == 0 && loads_left == 0) return send(kilobot, kNoFood, 0);
    lead(kilobot, load != 0);
  }

 private:
  [[nodiscard]] bool is_within(const Kilobot& kilobot, bool of_home, double margin_mm) const {
    const Point way = kilobot.getPosition() - (of_home ? home : food);
    const double radius_mm = (of_home ? home_radius_now_mm() : food_radius_now_mm()) + margin_mm;
    return squared(way.x()) + squared(way.y()) <= squared(radius_mm);
  }
  void lead(const Kilobot& kilobot, bool to_home) {
    const Point goal = to_home ? home : food, way = goal - kilobot.getPosition();
    const double distance_mm = __builtin_sqrt(squared(way.x()) + squared(way.y()));
    if (!to_home && distance_mm > scent_radius_mm) return;
    std::uint8_t type = kInside;
    if (!is_within(kilobot, to_home, 0)) {
      const double steps = kt_floor(distance_mm / kStep_mm) + 1;
      type = steps < 1.0 * kFarthest ? static_cast<std::uint8_t>(steps) : kFarthest;
    }
    send(kilobot, type, bearing_deg(kilobot, goal));
  }
  void swap(const Kilobot& kilobot) { send(kilobot, kSwap, carries[kilobot.getID()] != 0 ? kToHome : kToFood); }
  void send(const Kilobot& kilobot, std::uint8_t type, std::uint16_t data) {
    transmitKiloState(make_message(kilobot.getID(), type, data));
  }
};

class ForagingExperiment : public KilobotExperiment {
 public:
  void initialise(bool /*isResume*/) override {
    field_.home = {parameter("home_x_mm", 250), parameter("home_y_mm", -450)};
    field_.food = {parameter("food_x_mm", -450), parameter("food_y_mm", 250)};
    field_.home_radius_mm = parameter("home_radius_mm", 50);
    field_.food_radius_mm = parameter("food_radius_mm", 200);
    field_.scent_radius_mm = parameter("scent_radius_mm", 700);
    field_.loads = static_cast<std::uint32_t>(parameter("loads", 40));
    field_.loads_left = field_.loads;
    field_.carries.assign(robots(), 0);
    addEnvironment(&field_);
  }
  void serialize(Archive& archive) override { archive& field_.loads_left& field_.delivered& field_.carries; }
  [[nodiscard]] std::uint64_t word() override {
    std::uint64_t word = std::uint64_t{field_.loads_left} << 32 | field_.delivered;
    for (const std::uint8_t load : field_.carries) word = (word ^ load) * 0x6a09e667f3bcc909u + (word >> 29);
    return word;
  }
  /// Whether the robot carries a load; loads left; loads delivered.
  [[nodiscard]] std::string logState(Kilobot kilobot) override {
    return std::to_string(field_.carries[kilobot.getID()]) + '\t' + std::to_string(field_.loads_left) + '\t' +
           std::to_string(field_.delivered);
  }
  void paintFloor(Floor& floor) override {
    floor.circles.push_back({field_.food, field_.food_radius_now_mm(), {0xf6, 0xec, 0xd2}, "food"});
    floor.circles.push_back({field_.home, field_.home_radius_now_mm(), {0xdf, 0xf0, 0xe6}, "home"});
  }

 private:
  ForagingEnvironment field_;
};

}  // namespace

extern "C" KilobotExperiment* createExpt() { return new ForagingExperiment; }
