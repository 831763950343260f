/// Cameras above a live run.
#pragma once

#include <filesystem>
#include <optional>

#include "clients/cli/vision/camera_options.hpp"
#include "core/dds/dds.hpp"

namespace kilotwin::cli {

struct LiveCameras {
  dds::Transport transport;
  std::filesystem::path directory;     ///< ARK's four cameras; empty: none
  std::filesystem::path picture;       ///< one big picture; empty: none
  std::optional<std::uint16_t> mjpeg;  ///< port of the stream
  double frames_per_s = 30;            ///< of wall time, at most
  int quality = 90;                    ///< of JPEG pictures
  bool one_run = false;                ///< return when a run has ended
  bool quiet = false;
  CameraOptions camera;
};

/// Takes pictures until it is interrupted. Returns the exit status. Throws UserError and RunError.
int show_live(const LiveCameras& live);

}  // namespace kilotwin::cli
