/// The options of a camera: size, place, lens, light, noise.
#pragma once

#include <string>
#include <vector>

#include "clients/cameras/camera_model.hpp"
#include "clients/cameras/robot_look.hpp"
#include "core/plan/world.hpp"

namespace CLI {
class App;
}

namespace kilotwin::cli {

struct CameraOptions {
  std::string size = "1920x1080";
  double px_per_mm = 0;      ///< 0: the whole arena with its walls
  std::vector<double> lens;  ///< k1 k2 p1 p2 k3, as many as are given
  cameras::CameraModel model;
  cameras::Look look;
};

void add_camera_options(CLI::App& app, CameraOptions& options);

/// The camera above the middle of the arena. Throws UserError.
[[nodiscard]] cameras::CameraModel big_camera(const CameraOptions& options, const World& world);
/// The model with lens, light and noise of the options; its size and place are not set.
[[nodiscard]] cameras::CameraModel model_of(const CameraOptions& options);
/// The camera as OpenCV's FileStorage writes it in XML: width, height, K, distortion (OpenCV's order), R, position_mm.
[[nodiscard]] std::string camera_xml(const cameras::CameraModel& camera);

}  // namespace kilotwin::cli
