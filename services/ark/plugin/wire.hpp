/// Messages between the station and a plugin's process. A frame is a length of 4 octets, least significant first, and an
/// Archive of a Request or a Reply. Both ends run on one machine.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#define KILOTWIN_STATION_NO_GLOBAL_NAMES
#include "kilotwin_station.hpp"

namespace kilotwin::station {

enum class Call : std::uint8_t { kSetup, kStep, kSave, kLoad, kStop };

/// A robot as seen, in the arena's frame: mm, mm/s.
struct SeenRobot {
  double x_mm = 0, y_mm = 0, vx_mm = 0, vy_mm = 0;
  lightColour colour = OFF;
  bool seen = true;
  void serialize(Archive& archive) { archive& x_mm& y_mm& vx_mm& vy_mm& colour& seen; }
};

struct Request {
  Call call = Call::kStep;
  std::int64_t tick = 0;
  double time_s = 0;
  bool paint = false, log = false;  ///< wanted with this step
  std::vector<SeenRobot> robots{};  ///< by id
  std::string state{};              ///< to load
  // Of the set-up.
  bool resumed = false;
  std::uint64_t seed = 0;
  std::uint32_t index = 0;  ///< of the environment in the experiment
  double width_mm = 0, height_mm = 0;
  std::map<std::string, std::string> parameters{};

  void serialize(Archive& archive) {
    archive& call& tick& time_s& paint& log& robots& state;
    if (call == Call::kSetup) archive& resumed& seed& index& width_mm& height_mm& parameters;
  }
};

struct Sent {
  bool to_all = false;
  kilobot_id id = 0;
  std::uint8_t type = 0;
  std::uint16_t data = 0;
  std::array<std::uint8_t, 9> octets{};
  void serialize(Archive& archive) {
    archive& to_all& id& type;
    if (to_all)
      archive& octets;
    else
      archive& data;
  }
};

struct Report {
  std::string json, line;
  void serialize(Archive& archive) { archive& json& line; }
};

struct Reply {
  std::string failure{};  ///< one line: what went wrong and where; empty: nothing
  bool crashed = false;   ///< by a signal, rather than an exception
  std::vector<Sent> sent{};
  std::vector<Report> reports{};
  std::vector<std::string> rows{};  ///< of the log, per robot
  bool painted = false;
  Floor floor{};
  std::uint64_t word = 0;
  std::int32_t interval_ms = 100;  ///< of the set-up
  bool complete = false;
  bool resumable = true;  ///< of a state that was saved
  std::string state{};

  void serialize(Archive& archive) {
    archive& failure& crashed& sent& reports& rows& painted;
    if (painted) archive& floor;
    archive& word& interval_ms& complete& resumable& state;
  }
};

}  // namespace kilotwin::station
