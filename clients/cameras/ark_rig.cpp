#include "clients/cameras/ark_rig.hpp"

#include <vector>

namespace kilotwin::cameras {
namespace {

/// Scale of the panorama. The four cameras lie kStep apart in it, so that it is 3072 x 2304 px in ARK's reckoning, which adds one.
constexpr double kPxPerMm = 1.125;
constexpr int kStepX_px = 1023, kStepY_px = 767;
constexpr int kPanoramaWidth_px = kStepX_px + kArkWidth_px + 1, kPanoramaHeight_px = kStepY_px + kArkHeight_px + 1;
/// ARK shrinks the panorama to a square of this side.
constexpr int kShrunk_px = 1536;
static_assert(kShrunk_px * kArkWidth_px % kPanoramaWidth_px == 0);
static_assert(kShrunk_px * kArkHeight_px % kPanoramaHeight_px == 0);

/// Focal length in ARK's calibrations.
constexpr double kFocal_px = 2000;

constexpr double kShrinkX = static_cast<double>(kShrunk_px) / kPanoramaWidth_px;
constexpr double kShrinkY = static_cast<double>(kShrunk_px) / kPanoramaHeight_px;

/// Where a camera's picture begins in the panorama as ARK computes it: its offset in the shrunk panorama, truncated.
cv::Point2d effective_offset_px(int camera) {
  const int column = camera % 2, row = camera / 2;
  const int shrunk_x = column * kStepX_px * kShrunk_px / kPanoramaWidth_px;
  const int shrunk_y = row * kStepY_px * kShrunk_px / kPanoramaHeight_px;
  return {shrunk_x / kShrinkX, shrunk_y / kShrinkY};
}

/// Where the arena's upper left corner lies in the panorama: the arena is in its middle.
cv::Point2d arena_corner_px() {
  return {(kPanoramaWidth_px - 2 - 2 * kArkHalf_mm * kPxPerMm) / 2,
          (kPanoramaHeight_px - 2 - 2 * kArkHalf_mm * kPxPerMm) / 2};
}

}  // namespace

std::array<CameraModel, kArkCameras> ark_cameras(const CameraModel& like) {
  std::array<CameraModel, kArkCameras> cameras;
  for (int i = 0; i < kArkCameras; ++i) {
    const cv::Point2d middle = effective_offset_px(i) +
                               cv::Point2d{(kArkWidth_px - 1) / 2.0, (kArkHeight_px - 1) / 2.0} - arena_corner_px();
    const CameraModel overhead =
        CameraModel::overhead(kArkWidth_px, kArkHeight_px, kPxPerMm, middle.x / kPxPerMm - kArkHalf_mm,
                              kArkHalf_mm - middle.y / kPxPerMm, kFocal_px / kPxPerMm);
    CameraModel& camera = cameras.at(static_cast<std::size_t>(i));
    camera = like;
    camera.width_px = overhead.width_px;
    camera.height_px = overhead.height_px;
    camera.K = overhead.K;
    camera.R = overhead.R;
    camera.position_mm = overhead.position_mm;
    camera.seed = like.seed + static_cast<std::uint64_t>(i);
  }
  return cameras;
}

std::string ark_calibration_xml(const Distortion& lens) {
  cv::FileStorage file("calibration.xml", cv::FileStorage::WRITE | cv::FileStorage::MEMORY);
  const double side_px = 2 * kArkHalf_mm * kPxPerMm;
  for (int corner = 0; corner < 4; ++corner) {
    const cv::Point2d at = arena_corner_px() + cv::Point2d{corner % 2 * side_px, corner / 2 * side_px};
    // Shrinking keeps the edges of the picture, while coordinates are those of pixels' centres.
    const cv::Point2f shrunk(static_cast<float>((at.x + 0.5) * kShrinkX - 0.5),
                             static_cast<float>((at.y + 0.5) * kShrinkY - 0.5));
    file << "corner" + std::to_string(corner + 1) << shrunk;
  }
  std::vector<cv::Mat> rotations, intrinsics, exact;
  for (int i = 0; i < kArkCameras; ++i) {
    rotations.push_back(cv::Mat::eye(3, 3, CV_64F));
    const double x = i % 2 * kStepX_px, y = i / 2 * kStepY_px;
    intrinsics.push_back((cv::Mat_<double>(3, 3) << kFocal_px, 0, -x, 0, kFocal_px, -y, 0, 0, 1));
    const cv::Point2d at = effective_offset_px(i);
    exact.push_back((cv::Mat_<double>(3, 3) << kFocal_px, 0, -at.x, 0, kFocal_px, -at.y, 0, 0, 1));
  }
  file << "R" << rotations << "K" << intrinsics << "exact_K" << exact;
  if (!lens.none()) {
    std::vector<cv::Mat> lenses, distortions;
    for (const CameraModel& camera : ark_cameras({})) {
      lenses.push_back(cv::Mat(camera.K).clone());
      distortions.push_back((cv::Mat_<double>(1, 5) << lens.k1, lens.k2, lens.p1, lens.p2, lens.k3));
    }
    file << "lens_K" << lenses << "distortion" << distortions;
  }
  return file.releaseAndGetString();
}

}  // namespace kilotwin::cameras
