/// Two virtual environments that act on each other, each a raster over the arena. Rain falls below a cloud that wanders; water
/// dries and is drunk by grass. Grass grows where it is wet, and robots with a green LED graze it. A robot senses both where it
/// stands: bits 0..3 of its message are the grass, 0..15, bits 4..6 the water, 0..7.
#include <kilotwin_station.hpp>

namespace {

constexpr int kCells = 20;  // per side

class Raster {
 public:
  std::vector<double> level = std::vector<double>(kCells * kCells, 0);  ///< 0..1

  [[nodiscard]] std::size_t cell_at(Point place, Point arena_mm) const {
    const auto index = [](double at, double side_mm) {
      const int i = static_cast<int>((at / side_mm + 0.5) * kCells);
      return static_cast<std::size_t>(i < 0 ? 0 : i >= kCells ? kCells - 1 : i);
    };
    return index(place.y(), arena_mm.y()) * kCells + index(place.x(), arena_mm.x());
  }
};

class Rain : public KilobotEnvironment {
 public:
  Raster water;
  Point cloud, arena_mm;
  double radius_mm = 0, fall = 0, drying = 0;

  void update() override {
    for (std::size_t i = 0; i < water.level.size(); ++i) {
      const double side = 1.0 / kCells;
      const Point cell{(static_cast<double>(i % kCells) * side + side / 2 - 0.5) * arena_mm.x(),
                       (static_cast<double>(i / kCells) * side + side / 2 - 0.5) * arena_mm.y()};
      const Point way = cell - cloud;
      const bool rains = way.x() * way.x() + way.y() * way.y() < radius_mm * radius_mm;
      water.level[i] += rains ? fall * (1 - water.level[i]) : -drying * water.level[i];
    }
  }
};

class Grass : public KilobotEnvironment {
 public:
  Raster grass;
  Rain* rain = nullptr;
  double growth = 0, thirst = 0, bite = 0;
  double grazed = 0;  ///< all that robots have eaten, in full cells

  void update() override {
    for (std::size_t i = 0; i < grass.level.size(); ++i) {
      const double grown = growth * rain->water.level[i] * (1 - grass.level[i]);
      grass.level[i] += grown;
      rain->water.level[i] -= thirst * grown;
      if (rain->water.level[i] < 0) rain->water.level[i] = 0;
    }
  }
  void updateVirtualSensor(Kilobot kilobot) override {
    if (!kilobot.isSeen()) return;
    const std::size_t cell = grass.cell_at(kilobot.getPosition(), rain->arena_mm);
    if (kilobot.getLedColour() == GREEN) {
      const double eaten = grass.level[cell] < bite ? grass.level[cell] : bite;
      grass.level[cell] -= eaten;
      grazed += eaten;
    }
    const auto steps = [](double level, unsigned most) { return static_cast<unsigned>(level * most + 0.5); };
    transmitKiloState(
        make_message(kilobot.getID(), 0, steps(grass.level[cell], 15) | steps(rain->water.level[cell], 7) << 4));
  }
};

class Meadow : public KilobotExperiment {
 public:
  void initialise(bool /*isResume*/) override {
    rain_.arena_mm = arenaSize_mm();
    rain_.radius_mm = parameter("cloud_radius_mm", 300);
    rain_.fall = parameter("fall", 0.05);
    rain_.drying = parameter("drying", 0.002);
    cloud_speed_mm_ = parameter("cloud_speed_mm", 15);
    grass_.rain = &rain_;
    grass_.growth = parameter("growth", 0.01);
    grass_.thirst = parameter("thirst", 0.2);
    grass_.bite = parameter("bite", 0.02);
    addEnvironment(&rain_);
    addEnvironment(&grass_);  // all robots sense it
  }
  void run() override {
    // The cloud turns at random and stays over the arena.
    direction_rad_ += 0.1 * normal();
    const double step_mm = cloud_speed_mm_ * serviceInterval * 1e-3;
    const Point next = rain_.cloud + step_mm * Point(kt_cos(direction_rad_), kt_sin(direction_rad_));
    const bool inside =
        2 * std::fabs(next.x()) < rain_.arena_mm.x() && 2 * std::fabs(next.y()) < rain_.arena_mm.y();
    if (inside)
      rain_.cloud = next;
    else
      direction_rad_ += 2.5;
    KilobotExperiment::run();
  }
  void serialize(Archive& archive) override {
    archive& rain_.water.level& rain_.cloud& direction_rad_& grass_.grass.level& grass_.grazed;
  }
  [[nodiscard]] std::uint64_t word() override {
    std::uint64_t bits = 0;
    static_assert(sizeof bits == sizeof grass_.grazed);
    std::memcpy(&bits, &grass_.grazed, sizeof bits);
    return bits;
  }
  [[nodiscard]] std::string logState(Kilobot kilobot) override {
    const std::size_t cell = grass_.grass.cell_at(kilobot.getPosition(), rain_.arena_mm);
    return std::to_string(grass_.grass.level[cell]) + '\t' + std::to_string(rain_.water.level[cell]) + '\t' +
           std::to_string(grass_.grazed);
  }
  void paintFloor(Floor& floor) override {
    floor.resize(kCells, kCells);
    for (std::uint32_t row = 0; row < kCells; ++row) {
      for (std::uint32_t column = 0; column < kCells; ++column) {
        const std::size_t cell = (kCells - 1 - row) * kCells + column;  // row 0 is the top
        const auto shade = [](double level) { return static_cast<std::uint8_t>(255 - 140 * level); };
        const double grass = grass_.grass.level[cell], water = rain_.water.level[cell];
        floor.at(column, row) = {shade(grass > water ? grass : water), shade(water), shade(grass), 255};
      }
    }
    floor.circles.push_back({rain_.cloud, rain_.radius_mm, {0x80, 0x90, 0xb0, 60}, "cloud"});
  }

 private:
  Rain rain_;
  Grass grass_;
  double direction_rad_ = 0, cloud_speed_mm_ = 0;
};

}  // namespace

extern "C" KilobotExperiment* createExpt() { return new Meadow; }
