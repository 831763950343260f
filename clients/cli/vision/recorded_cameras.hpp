/// Cameras above a recorded run: pictures or a video, with the truth beside them. For tests of trackers.
#pragma once

#include <filesystem>

#include "clients/cli/vision/camera_options.hpp"

namespace kilotwin::cli {

struct RecordedCameras {
  std::filesystem::path run;
  std::filesystem::path out;    ///< directory of the pictures; exists and is empty
  std::filesystem::path video;  ///< instead of pictures: .avi, .mp4
  bool ark = false;             ///< ARK's four cameras
  double frames_per_s = 30;     ///< of simulated time
  double from_s = 0, to_s = 0;  ///< to_s 0: to the end
  int quality = 95;
  bool png = false;
  bool quiet = false;
  CameraOptions camera;
};

/// Writes frame_%05d.jpg (ARK: frame_%05d_%d.jpg) or the video, truth.csv (frame,time_s,robot,x_mm,y_mm,heading_rad,led,x_px,y_px),
/// and camera.xml (ARK: calibration.xml). Returns the exit status. Throws UserError and RunError.
int show_recorded(const RecordedCameras& recorded);

}  // namespace kilotwin::cli
