/// The interface of station plugins: virtual environments, virtual sensors and house-keeping that users write in C++ for the
/// base station of ARK (Augmented Reality for Kilobots). The names are ARK's own, so that experiments move over with few edits.
///
/// A plugin is one or more C++ sources with a function `createExpt`. The experiment file names them:
///
///     station { environment { plugin { source: "my_environment.cpp" parameter { name: "radius_mm" value: "300" } } } }
///
/// Order of the calls. At the start: `initialise`, then `setupInitialKilobotState` of every robot. Every `serviceInterval`:
/// `run`, which by default calls `update` of every environment and then `updateKilobotStates`; that calls `updateKilobotState`
/// and the environment's `updateVirtualSensor` of every robot, by ascending id.
///
/// Frame and units: mm, x to the right, y up, the origin at the arena's centre; angles in radians anticlockwise from x. With
/// `useArkPictureFrame()` positions are pixels of ARK's picture instead: 1 px = 1 mm, the origin at the top left corner, y down.
///
/// Results must be repeatable. Take random numbers from `uniform`, `normal` and `randomInteger`; never read a clock, a file or
/// the network. Keep in `serialize` all that changes. The functions of <cmath> give the same bits on every machine.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

// The mathematics of the simulation, with the same bits everywhere.
extern "C" {
double kt_sin(double);
double kt_cos(double);
double kt_atan2(double y, double x);
double kt_floor(double);
}

namespace kilotwin::station {

/// A place or a displacement; the unit is that of the frame, mm or px.
class Point {
 public:
  constexpr Point() = default;
  constexpr Point(double x, double y) : x_(x), y_(y) {}
  [[nodiscard]] constexpr double x() const { return x_; }
  [[nodiscard]] constexpr double y() const { return y_; }
  constexpr void setX(double x) { x_ = x; }
  constexpr void setY(double y) { y_ = y; }
  constexpr bool operator==(const Point&) const = default;
  friend constexpr Point operator+(Point a, Point b) { return {a.x_ + b.x_, a.y_ + b.y_}; }
  friend constexpr Point operator-(Point a, Point b) { return {a.x_ - b.x_, a.y_ - b.y_}; }
  friend constexpr Point operator*(double factor, Point a) { return {factor * a.x_, factor * a.y_}; }
  friend constexpr Point operator*(Point a, double factor) { return factor * a; }

 private:
  double x_ = 0, y_ = 0;
};

/// The colour of a LED as the tracker reports it.
enum lightColour : std::uint8_t { OFF = 0, RED = 1, GREEN = 2, BLUE = 3 };
using kilobot_colour = lightColour;

/// A robot's number in ARK's messages, 0..1022.
using kilobot_id = std::uint16_t;

/// For one robot. Three of them travel in an infrared message of type 0.
struct kilobot_message {
  std::uint8_t type : 4;
  kilobot_id id : 10;
  std::uint16_t data : 10;
};

/// The same, checked: id 0..1022, type 0..15, data 0..1023. Throws std::runtime_error.
[[nodiscard]] inline kilobot_message make_message(unsigned id, unsigned type, unsigned data) {
  constexpr unsigned kMostIds = 1023, kTypes = 16, kValues = 1024;
  if (id >= kMostIds || type >= kTypes || data >= kValues)
    throw std::runtime_error("a message of id " + std::to_string(id) + ", type " + std::to_string(type) +
                             ", data " + std::to_string(data) + "; they take 0..1022, 0..15, 0..1023");
  kilobot_message message{};
  message.id = static_cast<kilobot_id>(id & (kValues - 1));
  message.type = static_cast<std::uint8_t>(type & (kTypes - 1));
  message.data = static_cast<std::uint16_t>(data & (kValues - 1));
  return message;
}

/// For all robots: an infrared message of type 1..127 with up to 9 octets of data, repeated until the next packet.
struct kilobot_broadcast {
  std::uint8_t type = 0;
  std::vector<std::uint8_t> data{};
};

/// A robot as the station sees it.
class Kilobot {
 public:
  Kilobot() = default;
  Kilobot(kilobot_id id, Point position, Point velocity, lightColour colour, bool seen)
      : id_(id), position_(position), velocity_(velocity), colour_(colour), seen_(seen) {}
  [[nodiscard]] kilobot_id getID() const { return id_; }
  /// Centre of the disc.
  [[nodiscard]] Point getPosition() const { return position_; }
  /// Per second. Its direction is the robot's heading: the true one without a camera model, else the direction of motion. Its
  /// length is the speed of the centre, at least 0.001.
  [[nodiscard]] Point getVelocity() const { return velocity_; }
  [[nodiscard]] lightColour getLedColour() const { return colour_; }
  /// False: the tracker has lost it, and the rest is what it saw last.
  [[nodiscard]] bool isSeen() const { return seen_; }

 private:
  kilobot_id id_ = 0;
  Point position_, velocity_;
  lightColour colour_ = OFF;
  bool seen_ = true;
};

/// Writes values to octets or reads them back, in one order for both: `archive & level & carriers;`. It takes numbers, bool,
/// enums, std::string, std::vector, std::array, std::map, std::pair, std::optional, Point, and types with a
/// member `void serialize(Archive&)`. Throws std::runtime_error where octets to read are missing.
class Archive {
 public:
  Archive() = default;
  explicit Archive(std::string octets) : octets_(std::move(octets)), saving_(false) {}

  [[nodiscard]] bool saving() const { return saving_; }
  [[nodiscard]] const std::string& octets() const { return octets_; }
  [[nodiscard]] bool atEnd() const { return at_ == octets_.size(); }
  /// KilobotExperiment::serialize calls it unless a plugin overrides that function.
  void setNotProvided() { provided_ = false; }
  [[nodiscard]] bool isProvided() const { return provided_; }

  template <class T> Archive& operator&(T& value) {
    if constexpr (std::is_same_v<T, bool>) {
      auto octet = static_cast<std::uint8_t>(value);
      raw(&octet, 1);
      value = octet != 0;
    } else if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T>) {
      raw(&value, sizeof value);
    } else {
      value.serialize(*this);
    }
    return *this;
  }
  Archive& operator&(Point& point) {
    double x = point.x(), y = point.y();
    *this& x& y;
    point = Point(x, y);
    return *this;
  }
  Archive& operator&(std::string& text) {
    text.resize(count(text.size()));
    raw(text.data(), text.size());
    return *this;
  }
  template <class T> Archive& operator&(std::vector<T>& values) {
    values.resize(count(values.size()));
    if constexpr (std::is_same_v<T, bool>) {
      for (std::size_t i = 0; i < values.size(); ++i) {
        bool value = values[i];
        *this& value;
        values[i] = value;
      }
    } else {
      for (T& value : values) *this& value;
    }
    return *this;
  }
  template <class T, std::size_t N> Archive& operator&(std::array<T, N>& values) {
    for (T& value : values) *this& value;
    return *this;
  }
  template <class A, class B> Archive& operator&(std::pair<A, B>& pair) { return *this & pair.first & pair.second; }
  template <class T> Archive& operator&(std::optional<T>& value) {
    bool given = value.has_value();
    *this& given;
    if (given && !value) value.emplace();
    if (!given) value.reset();
    if (given) *this&* value;
    return *this;
  }
  template <class K, class V> Archive& operator&(std::map<K, V>& map) {
    const std::size_t size = count(map.size());
    if (saving_) {
      for (auto& [key, value] : map) {
        K copy = key;
        *this& copy& value;
      }
      return *this;
    }
    map.clear();
    for (std::size_t i = 0; i < size; ++i) {
      K key{};
      V value{};
      *this& key& value;
      map.emplace(std::move(key), std::move(value));
    }
    return *this;
  }

 private:
  void raw(void* value, std::size_t size) {
    if (saving_) {
      octets_.append(static_cast<const char*>(value), size);
      return;
    }
    if (size > octets_.size() - at_) throw std::runtime_error("the octets end within a value");
    std::memcpy(value, octets_.data() + at_, size);
    at_ += size;
  }
  std::size_t count(std::size_t now) {
    auto size = static_cast<std::uint64_t>(now);
    raw(&size, sizeof size);
    // Every element takes an octet at least; so damaged octets never ask for much memory.
    if (!saving_ && size > octets_.size() - at_) throw std::runtime_error("the octets end within a list");
    return static_cast<std::size_t>(size);
  }

  std::string octets_;
  std::size_t at_ = 0;
  bool saving_ = true, provided_ = true;
};

/// 0..255 each; alpha 0 is transparent.
struct Colour {
  std::uint8_t red = 0, green = 0, blue = 0, alpha = 255;
  bool operator==(const Colour&) const = default;
  void serialize(Archive& archive) { archive& red& green& blue& alpha; }
};

/// The picture that viewers draw under the robots: a raster over the whole arena, and circles on it.
class Floor {
 public:
  static constexpr std::uint32_t kMostCells = 256;  ///< per side

  /// Begins a transparent raster of columns x rows cells, 1..256 each. Row 0 lies at the arena's top.
  void resize(std::uint32_t columns, std::uint32_t rows) {
    if (columns < 1 || rows < 1 || columns > kMostCells || rows > kMostCells)
      throw std::runtime_error("a floor takes 1 to 256 columns and rows");
    columns_ = columns;
    rows_ = rows;
    cells_.assign(std::size_t{columns} * rows, Colour{0, 0, 0, 0});
  }
  [[nodiscard]] std::uint32_t columns() const { return columns_; }
  [[nodiscard]] std::uint32_t rows() const { return rows_; }
  [[nodiscard]] Colour& at(std::uint32_t column, std::uint32_t row) {
    return cells_.at(std::size_t{row} * columns_ + column);
  }
  [[nodiscard]] const std::vector<Colour>& cells() const { return cells_; }

  struct Circle {
    Point centre;  ///< in the plugin's frame
    double radius = 0;
    Colour colour;
    std::string text;
    bool operator==(const Circle&) const = default;
    void serialize(Archive& archive) { archive& centre& radius& colour& text; }
  };
  std::vector<Circle> circles;

  [[nodiscard]] bool empty() const { return cells_.empty() && circles.empty(); }
  bool operator==(const Floor&) const = default;
  void serialize(Archive& archive) { archive& columns_& rows_& cells_& circles; }

 private:
  std::uint32_t columns_ = 0, rows_ = 0;
  std::vector<Colour> cells_;
};

class KilobotEnvironment;

/// Services of the station to a plugin. Plugins use it by the functions of KilobotExperiment and KilobotEnvironment.
class Services {
 public:
  virtual ~Services() = default;
  virtual void send(const kilobot_message&) = 0;
  virtual void broadcast(const kilobot_broadcast&) = 0;
  virtual void setEnvironment(KilobotEnvironment*) = 0;
  virtual void initialStates() = 0;
  virtual void updateStates() = 0;
  virtual void complete() = 0;
  virtual void report(const std::string& json, const std::string& line) = 0;
  [[nodiscard]] virtual std::optional<std::string> parameter(const std::string& name) = 0;
  [[nodiscard]] virtual double uniform() = 0;
  [[nodiscard]] virtual double normal() = 0;
  [[nodiscard]] virtual std::uint32_t robots() const = 0;
  [[nodiscard]] virtual Point arenaSize_mm() const = 0;
  virtual void useArkPictureFrame() = 0;
};

namespace detail {
/// Of the plugin that runs on this thread.
inline thread_local Services* services = nullptr;

inline Services& here() {
  if (services == nullptr)
    throw std::logic_error("the station is not there yet: do this in initialise(), not in a constructor");
  return *services;
}
}  // namespace detail

/// A virtual environment with its virtual sensors.
class KilobotEnvironment {
 public:
  virtual ~KilobotEnvironment() = default;
  /// A step of the environment's own change, every service interval.
  virtual void update() {}
  /// Sends this robot what it senses, by transmitKiloState, or nothing.
  virtual void updateVirtualSensor(Kilobot kilobot) { static_cast<void>(kilobot); }

 protected:
  /// Queues a message. A newer one for the same robot replaces one that still waits.
  void transmitKiloState(const kilobot_message& message) { detail::here().send(message); }
};

/// An experiment: its environments, the robots' states, what is logged and saved.
class KilobotExperiment {
 public:
  virtual ~KilobotExperiment() = default;

  /// Sets up environments. `isResume`: the state comes from a checkpoint, by serialize(), next.
  virtual void initialise(bool isResume) = 0;
  /// Every service interval. Override it as in ARK, or leave it and override the rest.
  virtual void run() {
    for (KilobotEnvironment* const environment : environments_) environment->update();
    updateKilobotStates();
  }
  /// At the end of the run.
  virtual void stopExperiment() {}
  virtual void setupInitialKilobotState(Kilobot kilobot) { static_cast<void>(kilobot); }
  virtual void updateKilobotState(Kilobot kilobot) { static_cast<void>(kilobot); }

  /// Saves or restores all that changes. A run whose plugin lacks it cannot be resumed.
  virtual void serialize(Archive& archive) { archive.setNotProvided(); }
  /// A word for the state hash, of what the messages do not show.
  [[nodiscard]] virtual std::uint64_t word() { return 0; }
  /// The columns that follow `t id colour x y orientation` in the log, separated by tabs.
  [[nodiscard]] virtual std::string logState(Kilobot kilobot) {
    static_cast<void>(kilobot);
    return {};
  }
  /// Paints the floor for viewers; it may stay empty.
  virtual void paintFloor(Floor& floor) { floor.circles = drawings_; }

  // Called by the station.
  void attach(Services* services) { attached(services); }
  [[nodiscard]] int serviceInterval_ms() const { return serviceInterval; }
  void setTime_s(double time_s) { time = time_s; }
  void serializeDrawings(Archive& archive) { archive& drawings_; }

 protected:
  int serviceInterval = 100;  ///< ms; set it in initialise()
  double time = 0;            ///< s since the start

  /// Its update() is called by the default run(), and all robots sense it unless setCurrentKilobotEnvironment() says another.
  void addEnvironment(KilobotEnvironment* environment) {
    environments_.push_back(environment);
    detail::here().setEnvironment(environment);
  }
  /// Of the robot at hand, within setupInitialKilobotState and updateKilobotState; elsewhere of all robots.
  void setCurrentKilobotEnvironment(KilobotEnvironment* environment) { detail::here().setEnvironment(environment); }
  void signalKilobot(const kilobot_message& message) { detail::here().send(message); }
  /// The packet that all robots hear. Type 250 is ARK's STOP: it ends the repetition.
  void broadcastMessage(const kilobot_broadcast& message) { detail::here().broadcast(message); }
  void getInitialKilobotStates() { detail::here().initialStates(); }
  void updateKilobotStates() { detail::here().updateStates(); }
  /// The plugin has done its work and is not called any more.
  void experimentComplete() { detail::here().complete(); }
  /// Writes `json` to the run directory, and tells the user `line`.
  void report(const std::string& json, const std::string& line) { detail::here().report(json, line); }
  /// Numbers are positions in the plugin's frame.
  void drawCircle(Point centre, double radius, Colour colour, std::string text = {}) {
    drawings_.push_back({centre, radius, colour, std::move(text)});
  }
  void clearDrawings() { drawings_.clear(); }

  // Of the experiment file.
  [[nodiscard]] double parameter(const std::string& name, double otherwise) {
    const std::optional<std::string> text = detail::here().parameter(name);
    if (!text) return otherwise;
    std::size_t used = 0;
    double value = 0;
    try {
      value = std::stod(*text, &used);
    } catch (const std::logic_error&) {
      used = 0;
    }
    if (used == 0 || used != text->size() || value - value != 0)
      throw std::runtime_error("parameter " + name + " is \"" + *text + "\"; it takes a number");
    return value;
  }
  [[nodiscard]] std::string textParameter(const std::string& name, const std::string& otherwise) {
    return detail::here().parameter(name).value_or(otherwise);
  }

  [[nodiscard]] std::uint32_t robots() const { return detail::here().robots(); }
  /// Width and height of the rectangle around the arena.
  [[nodiscard]] Point arenaSize_mm() const { return detail::here().arenaSize_mm(); }
  /// Positions and velocities are those of ARK's picture from here on: pixels of 1 mm, y down. Call it in initialise().
  void useArkPictureFrame() { detail::here().useArkPictureFrame(); }

  /// Uniform in (0, 1); standard normal; uniform in 0..below-1. The same numbers in every run of the same seed.
  [[nodiscard]] double uniform() { return detail::here().uniform(); }
  [[nodiscard]] double normal() { return detail::here().normal(); }
  [[nodiscard]] std::uint32_t randomInteger(std::uint32_t below) {
    return static_cast<std::uint32_t>(detail::here().uniform() * below);
  }

 private:
  /// Virtual, so that a plugin in a shared object sets its own copy of the pointer.
  virtual void attached(Services* services) { detail::services = services; }

  std::vector<KilobotEnvironment*> environments_;
  std::vector<Floor::Circle> drawings_;
};

/// The bearing of a place from a robot, whole degrees 0..359, anticlockwise from its heading as seen from above. In ARK's
/// picture frame the same: `y_down` says that y points down there.
[[nodiscard]] inline std::uint16_t bearing_deg(const Kilobot& kilobot, Point place, bool y_down = false) {
  const Point way = place - kilobot.getPosition(), heading = kilobot.getVelocity();
  const double side = y_down ? -1 : 1;
  constexpr double kDegrees = 180 / 3.14159265358979323846;
  const double bearing = (kt_atan2(side * way.y(), way.x()) - kt_atan2(side * heading.y(), heading.x())) * kDegrees;
  auto degrees = static_cast<int>(kt_floor(bearing + 0.5)) % 360;
  if (degrees < 0) degrees += 360;
  return static_cast<std::uint16_t>(degrees);
}

}  // namespace kilotwin::station

/// A plugin defines it. The station calls it once and deletes what it returns.
extern "C" kilotwin::station::KilobotExperiment* createExpt();

// ARK's names stand alone.
#ifndef KILOTWIN_STATION_NO_GLOBAL_NAMES
using namespace kilotwin::station;  // NOLINT(google-build-using-namespace)
#endif
