/// A circle that robots sense: `station { environment { hub { ... } } }`. Meaning, units and defaults of the parameters x_mm,
/// y_mm and radius_mm: HubEnvironment in idl/experiment.proto.
#include <kilotwin_station.hpp>

namespace {

/// Type 1 inside, 0 outside; the data is the bearing of the centre, degrees.
class HubEnvironment : public KilobotEnvironment {
 public:
  Point centre;
  double radius_mm = 0;

  void updateVirtualSensor(Kilobot kilobot) override {
    if (!kilobot.isSeen()) return;
    const Point way = centre - kilobot.getPosition();
    const bool inside = way.x() * way.x() + way.y() * way.y() <= radius_mm * radius_mm;
    transmitKiloState(make_message(kilobot.getID(), inside ? 1 : 0, bearing_deg(kilobot, centre)));
  }
};

class HubExperiment : public KilobotExperiment {
 public:
  void initialise(bool /*isResume*/) override {
    hub_.centre = {parameter("x_mm", 0), parameter("y_mm", 0)};
    hub_.radius_mm = parameter("radius_mm", 300);
    addEnvironment(&hub_);
    drawCircle(hub_.centre, hub_.radius_mm, {0xe3, 0xec, 0xf7}, "hub");
  }
  void serialize(Archive& /*archive*/) override {}

 private:
  HubEnvironment hub_;
};

}  // namespace

extern "C" KilobotExperiment* createExpt() { return new HubExperiment; }
