/// The station's own streams of random numbers: numbers of core/random/random.hpp that no other stream has.
#pragma once

#include "core/random/random.hpp"

namespace kilotwin {

/// What the station's camera makes of robots: services/ark/camera_model.cpp. Tick: the frame; entity: the robot.
inline constexpr Stream kCameraStream{100};
/// What plugins draw, in the order of their calls. Entity: the environment, and every 2^16 draws 2^16 more.
inline constexpr Stream kStationPluginStream{101};

}  // namespace kilotwin
