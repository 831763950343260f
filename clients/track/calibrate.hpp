/// Calibration: from pictures of a checkerboard, or from four corners of the arena, to a FloorMap; and its file.
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "clients/track/floor_map.hpp"

namespace kilotwin::track {

struct Board {
  int columns = 0, rows = 0;  ///< inner corners
  double square_mm = 0;
};

struct Calibration {
  FloorMap map;
  cv::Size picture;
  double residual_px = 0;  ///< root mean square distance of corners from where the map puts them
  double residual_mm = 0;  ///< the same on the floor, for the first picture
  int pictures = 0;        ///< in which the board was found
};

/// The board lies on the floor in the first picture, and anywhere in the others. Three or more pictures give lens and pose; with
/// fewer, the map is that of a plane, and `disc_height_mm` must be 0. The origin is the board's middle; x points along its rows,
/// as far to the right in the picture as this goes. Throws UserError where the board is not found in the first picture.
[[nodiscard]] Calibration calibrate(const std::vector<cv::Mat>& pictures, const Board& board,
                                    double disc_height_mm);

/// OpenCV's FileStorage, YAML or XML. Throws RunError.
void write_calibration(const Calibration& calibration, const std::filesystem::path& file);
/// Reads a file of write_calibration, camera.xml of `kilotwin cameras`, or a file with corner1..corner4 as ARK writes them: pixels of the arena's corners (top left, top
/// right, bottom left, bottom right), where `arena_mm` states the arena's size. Throws UserError.
[[nodiscard]] FloorMap read_calibration(const std::filesystem::path& file, const cv::Size2d& arena_mm);

}  // namespace kilotwin::track
