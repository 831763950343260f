#include "clients/track/calibrate.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>

#include "clients/track/brightness.hpp"
#include "core/base/error.hpp"

namespace kilotwin::track {
namespace {

std::optional<std::vector<cv::Point2f>> corners_of(const cv::Mat& picture, const Board& board) {
  const cv::Mat grey = grey_of(picture);
  std::vector<cv::Point2f> corners;
  if (!cv::findChessboardCorners(grey, {board.columns, board.rows}, corners,
                                 cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE))
    return std::nullopt;
  // The window stays within a square.
  const double side = std::hypot(corners[1].x - corners[0].x, corners[1].y - corners[0].y);
  const int half = std::clamp(cvFloor(side / 4), 2, 11);
  cv::cornerSubPix(grey, corners, {half, half}, {-1, -1},
                   cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 60, 1e-4));
  return corners;
}

/// Points of the board, mm, in the order of OpenCV's corners, with x to the right and y up in the first picture.
std::vector<cv::Point3f> board_points(const Board& board, const std::vector<cv::Point2f>& corners) {
  const cv::Point2f along = corners[static_cast<std::size_t>(board.columns) - 1] - corners.front();
  const cv::Point2f down = corners[corners.size() - static_cast<std::size_t>(board.columns)] - corners.front();
  const bool rows_are_x = std::abs(along.x) >= std::abs(along.y);
  std::vector<cv::Point3f> points;
  for (int row = 0; row < board.rows; ++row) {
    for (int column = 0; column < board.columns; ++column) {
      const double u = (column - 0.5 * (board.columns - 1)) * board.square_mm;
      const double v = (row - 0.5 * (board.rows - 1)) * board.square_mm;
      const double x = rows_are_x ? (along.x > 0 ? u : -u) : (down.x > 0 ? v : -v);
      const double y = rows_are_x ? (down.y > 0 ? -v : v) : (along.y > 0 ? -u : u);
      points.emplace_back(static_cast<float>(x), static_cast<float>(y), 0.0F);
    }
  }
  return points;
}

FloorMap plane_of(const std::vector<cv::Point3f>& points, const std::vector<cv::Point2f>& corners) {
  std::vector<cv::Point2f> flat;
  for (const cv::Point3f& p : points) flat.emplace_back(p.x, p.y);
  return FloorMap::plane(cv::Matx33d(cv::findHomography(flat, corners)));
}

struct Seen {
  std::vector<std::vector<cv::Point3f>> points;
  std::vector<std::vector<cv::Point2f>> corners;
};

FloorMap camera_of(const Seen& seen, const cv::Size& size, double disc_height_mm, double* residual_px) {
  cv::Mat intrinsic, distortion;
  std::vector<cv::Mat> rotations, translations;
  *residual_px = cv::calibrateCamera(seen.points, seen.corners, size, intrinsic, distortion, rotations,
                                     translations, cv::CALIB_FIX_K3);
  CameraPose pose;
  pose.intrinsic = cv::Matx33d(intrinsic);
  pose.distortion = distortion;
  cv::Mat rotation;
  cv::Rodrigues(rotations.front(), rotation);
  pose.rotation = cv::Matx33d(rotation);
  pose.translation_mm = cv::Vec3d(translations.front());
  pose.disc_height_mm = disc_height_mm;
  return FloorMap::camera(pose);
}

/// Residuals of the first picture, whose board lies at height 0.
void judge(Calibration& calibration, FloorMap map, const std::vector<cv::Point3f>& points,
           const std::vector<cv::Point2f>& corners) {
  if (map.camera_pose()) {
    CameraPose on_floor = *map.camera_pose();
    on_floor.disc_height_mm = 0;
    map = FloorMap::camera(on_floor);
  }
  double px = 0, mm = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Point there = map.pixel({points[i].x, points[i].y});
    const FloorPoint on_floor = map.floor({corners[i].x, corners[i].y});
    px += std::pow(there.x_px - corners[i].x, 2) + std::pow(there.y_px - corners[i].y, 2);
    mm += std::pow(on_floor.x_mm - points[i].x, 2) + std::pow(on_floor.y_mm - points[i].y, 2);
  }
  calibration.residual_px = std::sqrt(px / static_cast<double>(points.size()));
  calibration.residual_mm = std::sqrt(mm / static_cast<double>(points.size()));
}

template <class Matrix> Matrix matrix_at(const cv::FileStorage& storage, const char* key, const std::string& file) {
  cv::Mat value;
  storage[key] >> value;
  if (value.rows * value.cols != Matrix::rows * Matrix::cols)
    throw UserError(fmt::format("{}:1:1: {} is no matrix of {} numbers; write the file with --calibrate", file, key,
                                Matrix::rows * Matrix::cols));
  value.convertTo(value, CV_64F);
  return Matrix(value.reshape(1, Matrix::rows));
}

}  // namespace

Calibration calibrate(const std::vector<cv::Mat>& pictures, const Board& board, double disc_height_mm) {
  Seen seen;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const auto corners = corners_of(pictures[i], board);
    if (!corners && i == 0)
      throw UserError(
          fmt::format("--board {}x{}: no such board in the first picture; count the inner corners, and show "
                      "the whole board with a white margin",
                      board.columns, board.rows));
    if (!corners) continue;
    seen.corners.push_back(*corners);
    seen.points.push_back(board_points(board, seen.corners.front()));
  }
  if (seen.corners.empty()) throw UserError("--calibrate: there are no pictures");
  const cv::Size size = pictures.front().size();
  constexpr std::size_t kForLens = 3;
  double all_px = 0;
  const bool lens = seen.corners.size() >= kForLens;
  if (!lens && disc_height_mm != 0)
    throw UserError(
        fmt::format("--height {:g}: needs the board in {} pictures or more, and it was found in {}; else lay "
                    "the board at the height of the discs, with --height 0",
                    disc_height_mm, kForLens, seen.corners.size()));
  Calibration calibration{
      lens ? camera_of(seen, size, disc_height_mm, &all_px) : plane_of(seen.points.front(), seen.corners.front()),
      size, 0, 0, static_cast<int>(seen.corners.size())};
  judge(calibration, calibration.map, seen.points.front(), seen.corners.front());
  return calibration;
}

void write_calibration(const Calibration& calibration, const std::filesystem::path& file) {
  try {
    cv::FileStorage storage(file.string(), cv::FileStorage::WRITE);
    if (!storage.isOpened()) throw RunError(fmt::format("{}: cannot be written", file.string()));
    const bool camera = calibration.map.camera_pose().has_value();
    storage << "kilotwin_calibration" << (camera ? "camera" : "plane");
    storage << "width_px" << calibration.picture.width << "height_px" << calibration.picture.height;
    storage << "residual_px" << calibration.residual_px << "residual_mm" << calibration.residual_mm;
    storage << "pictures" << calibration.pictures;
    if (camera) {
      const CameraPose& pose = *calibration.map.camera_pose();
      storage << "K" << cv::Mat(pose.intrinsic) << "distortion" << pose.distortion << "R" << cv::Mat(pose.rotation)
              << "t_mm" << cv::Mat(pose.translation_mm) << "disc_height_mm" << pose.disc_height_mm;
    } else {
      storage << "to_px" << cv::Mat(calibration.map.to_px());
    }
  } catch (const cv::Exception& error) {
    throw RunError(fmt::format("{}: cannot be written: {}", file.string(), error.err));
  }
}

FloorMap read_calibration(const std::filesystem::path& file, const cv::Size2d& arena_mm) {
  const std::string name = file.string();
  try {
    const cv::FileStorage storage(name, cv::FileStorage::READ);
    if (!storage.isOpened()) throw UserError(fmt::format("{}: cannot be read", name));
    if (!storage["corner1"].empty()) {
      std::vector<cv::Point2f> pixels(4);
      const std::array<const char*, 4> keys{"corner1", "corner2", "corner3", "corner4"};
      for (std::size_t i = 0; i < keys.size(); ++i) storage[keys[i]] >> pixels[i];
      const auto w = static_cast<float>(arena_mm.width / 2), h = static_cast<float>(arena_mm.height / 2);
      if (w <= 0 || h <= 0)
        throw UserError(fmt::format("{}: has corners alone; state the arena's size with --arena", name));
      const std::vector<cv::Point2f> floor{{-w, h}, {w, h}, {-w, -h}, {w, -h}};
      return FloorMap::plane(cv::Matx33d(cv::getPerspectiveTransform(floor, pixels)));
    }
    if (!storage["position_mm"].empty()) {
      CameraPose pose;
      pose.intrinsic = matrix_at<cv::Matx33d>(storage, "K", name);
      pose.rotation = matrix_at<cv::Matx33d>(storage, "R", name);
      pose.translation_mm = -(pose.rotation * matrix_at<cv::Vec3d>(storage, "position_mm", name));
      storage["distortion"] >> pose.distortion;
      return FloorMap::camera(pose);
    }
    std::string kind;
    storage["kilotwin_calibration"] >> kind;
    if (kind == "plane") return FloorMap::plane(matrix_at<cv::Matx33d>(storage, "to_px", name));
    if (kind != "camera")
      throw UserError(fmt::format(
          "{}:1:1: is no calibration; expected a file of --calibrate, or one with corner1..corner4", name));
    CameraPose pose;
    pose.intrinsic = matrix_at<cv::Matx33d>(storage, "K", name);
    pose.rotation = matrix_at<cv::Matx33d>(storage, "R", name);
    pose.translation_mm = matrix_at<cv::Vec3d>(storage, "t_mm", name);
    storage["distortion"] >> pose.distortion;
    storage["disc_height_mm"] >> pose.disc_height_mm;
    return FloorMap::camera(pose);
  } catch (const cv::Exception& error) {
    throw UserError(fmt::format("{}:1:1: cannot be read: {}", name, error.err));
  }
}

}  // namespace kilotwin::track
