/// Where a place lies, in 7 bits: 0..119 the bearing in steps of 3 degrees, anticlockwise from the heading; 127 within 100 mm.
#include <kilotwin_station.hpp>

namespace {

class Compass : public KilobotEnvironment {
 public:
  Point place;

  void updateVirtualSensor(Kilobot kilobot) override {
    constexpr double kNear_mm = 100;
    constexpr unsigned kThere = 127, kStep_deg = 3;
    if (!kilobot.isSeen()) return;
    const Point way = place - kilobot.getPosition();
    const bool there = way.x() * way.x() + way.y() * way.y() < kNear_mm * kNear_mm;
    transmitKiloState(make_message(kilobot.getID(), 0, there ? kThere : bearing_deg(kilobot, place) / kStep_deg));
  }
};

class CompassExperiment : public KilobotExperiment {
 public:
  void initialise(bool /*isResume*/) override {
    compass_.place = {parameter("x_mm", 0), parameter("y_mm", 0)};
    addEnvironment(&compass_);
    drawCircle(compass_.place, 100, {0xdf, 0xf0, 0xe6}, "nest");
  }
  void serialize(Archive& /*archive*/) override {}

 private:
  Compass compass_;
};

}  // namespace

extern "C" KilobotExperiment* createExpt() { return new CompassExperiment; }
