/// One picture of the arena from ARK's four cameras and its calibration file: lens, rotation, corners.
///
/// ARK's file has K[4] and R[4]. They put camera i onto a panorama, a plane of focal length f = 2000 px: (u, v, w) = R K^-1 p for
/// pixel p, at (f u / w, f v / w). corner1..4 are the arena's corners in the panorama, shrunk to 1536 x 1536.
///
/// Three keys may be there that ARK ignores. lens_K[4] and distortion[4] (OpenCV's coefficients): each picture is corrected
/// first, and K holds for the corrected picture. exact_K[4]: ARK truncates offsets to whole pixels and adds one to the panorama's
/// size; a file that was made for this reckoning says here where its cameras really are.
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "clients/track/capture_clock.hpp"
#include "clients/track/floor_map.hpp"
#include "clients/track/source.hpp"

namespace kilotwin::track {

inline constexpr std::size_t kArkCameras = 4;
/// Size of a camera's picture: ARK takes no other.
inline constexpr int kArkWidth_px = 2048, kArkHeight_px = 1536;

struct ArkCalibration {
  std::array<cv::Matx33d, kArkCameras> K, R;
  std::optional<std::array<cv::Matx33d, kArkCameras>> exact_K;
  std::array<cv::Matx33d, kArkCameras> lens_K;   ///< as `distortion` was measured with
  std::array<cv::Mat, kArkCameras> distortion;   ///< CV_64F; empty: none
  std::array<cv::Point2d, kArkCameras> corners;  ///< top left, top right, bottom left, bottom right
  cv::Size2d arena_mm;
};

/// Nothing where the file has no K and R. Throws UserError where it has, and they are no calibration.
[[nodiscard]] std::optional<ArkCalibration> read_ark_calibration(const std::filesystem::path& file,
                                                                 const cv::Size2d& arena_mm);

/// Puts the four pictures of one frame together.
class ArkMosaic {
 public:
  explicit ArkMosaic(const ArkCalibration& calibration);

  /// Each pixel comes from the camera in which it lies farthest from the picture's rim; what no camera sees is black.
  /// Throws UserError where a picture is not of ARK's size.
  [[nodiscard]] cv::Mat join(const std::array<cv::Mat, kArkCameras>& pictures) const;
  /// Of the joined picture, whose origin is the arena's middle.
  [[nodiscard]] const FloorMap& floor() const { return floor_; }
  /// Where a point of the floor appears in a camera's picture.
  [[nodiscard]] Point in_camera(std::size_t camera, const FloorPoint& point) const;

 private:
  struct Part {
    cv::Rect where;     ///< in the joined picture
    cv::Mat xy, share;  ///< maps of cv::remap
    cv::Mat mine;       ///< 255 where this camera serves
  };

  void lay_out();
  void map_parts();

  ArkCalibration calibration_;
  std::array<cv::Matx33d, kArkCameras> to_ideal_;  ///< from mm of the floor to a pixel of the corrected picture
  cv::Size size_;
  FloorMap floor_ = FloorMap::plane(cv::Matx33d::eye());
  std::array<Part, kArkCameras> parts_;
};

/// Whether a directory has pictures of ARK's cameras.
[[nodiscard]] bool is_ark_directory(const std::filesystem::path& directory);

/// The joined pictures of a directory frame_%05d_%d.jpg, camera 0..3. With `watch`, frames are waited for; else a frame that lacks
/// a camera is a UserError.
class ArkDirectory : public Source {
 public:
  ArkDirectory(std::filesystem::path directory, const SourceOptions& options, const ArkCalibration& calibration);
  std::optional<CapturedFrame> next(const std::atomic<bool>& stop) override;
  [[nodiscard]] bool live() const override { return options_.watch; }
  [[nodiscard]] const FloorMap& floor() const { return mosaic_.floor(); }

 private:
  [[nodiscard]] std::optional<int> next_number(const std::atomic<bool>& stop);
  [[nodiscard]] std::filesystem::path file(int number, std::size_t camera) const;

  std::filesystem::path directory_;
  SourceOptions options_;
  ArkMosaic mosaic_;
  std::vector<int> numbers_;  ///< of the frames; a directory that grows has none
  int last_ = -1;
  std::uint64_t frames_ = 0;
  CaptureClock clock_;
};

}  // namespace kilotwin::track
