/// The four cameras of ARK, the base station, and the calibration file that belongs to them.
///
/// ARK makes one picture of 2000 x 2000 px of four: 1 px is 1 mm, the arena's centre lies at (1000, 1000), y grows downward. Its
/// steps, with the height adjustments of its window at 0: place camera i at (X_i, Y_i) of a panorama, as K_i says; shrink the
/// panorama to 1536 x 1536; map the quadrilateral corner1..4 to the square. Its arithmetic truncates sizes and offsets to whole
/// pixels. The rig is chosen so that sizes divide without rest, and cameras stand where truncated offsets are exact.
#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <string>

#include "clients/cameras/camera_model.hpp"

namespace kilotwin::cameras {

/// Size of one camera's picture, and half of the square of the arena that ARK sees.
inline constexpr int kArkWidth_px = 2048, kArkHeight_px = 1536;
inline constexpr double kArkHalf_mm = 1000;
inline constexpr int kArkCameras = 4;

/// Camera i = 0..3: left or right column (i % 2), upper or lower row (i / 2). `like`: lens, light and noise of all four; its size,
/// K, R and position are replaced, its seed is counted up.
[[nodiscard]] std::array<CameraModel, kArkCameras> ark_cameras(const CameraModel& like);

/// The calibration as OpenCV's FileStorage writes it in XML: corner1..4, R[4], K[4]. ARK ignores the rest, which `kilotwin track`
/// reads: exact_K[4], where the cameras are without ARK's truncation; with a lens also lens_K[4] and distortion[4].
[[nodiscard]] std::string ark_calibration_xml(const Distortion& lens = {});

}  // namespace kilotwin::cameras
