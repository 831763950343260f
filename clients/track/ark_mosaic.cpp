#include "clients/track/ark_mosaic.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <thread>
#include <utility>

#include "core/base/error.hpp"

namespace kilotwin::track {
namespace fs = std::filesystem;
namespace {

/// Focal length of the panorama, and the side of the square to which ARK shrinks it.
constexpr double kPanorama_px = 2000;
constexpr int kShrunk_px = 1536;
/// A joined picture is no larger than this.
constexpr int kMostSide_px = 3000;

cv::Point2d through(const cv::Matx33d& matrix, const cv::Point2d& p) {
  const cv::Vec3d q = matrix * cv::Vec3d(p.x, p.y, 1);
  return {q[0] / q[2], q[1] / q[2]};
}

std::array<cv::Mat, kArkCameras> matrices(const cv::FileStorage& storage, const char* key, int numbers,
                                          const std::string& file) {
  std::vector<cv::Mat> read;
  storage[key] >> read;
  const bool fits = read.size() == kArkCameras && std::all_of(read.begin(), read.end(), [&](const cv::Mat& one) {
                      return one.channels() == 1 && one.rows * one.cols >= numbers;
                    });
  if (!fits)
    throw UserError(fmt::format("{}:1:1: {} holds no matrices of {} numbers for 4 cameras", file, key, numbers));
  std::array<cv::Mat, kArkCameras> made;
  for (std::size_t i = 0; i < kArkCameras; ++i) {
    read[i].convertTo(made.at(i), CV_64F);
    if (!cv::checkRange(made.at(i)))
      throw UserError(fmt::format("{}:1:1: {} of camera {} has a number that is none", file, key, i));
  }
  return made;
}

std::array<cv::Matx33d, kArkCameras> square_matrices(const cv::FileStorage& storage, const char* key,
                                                     const std::string& file) {
  const std::array<cv::Mat, kArkCameras> read = matrices(storage, key, 9, file);
  std::array<cv::Matx33d, kArkCameras> made;
  for (std::size_t i = 0; i < kArkCameras; ++i) {
    const cv::Mat& one = read.at(i);
    if (one.rows != 3 || one.cols != 3 || std::abs(cv::determinant(one)) < 1e-9)
      throw UserError(fmt::format("{}:1:1: {} of camera {} is no 3x3 matrix with an inverse", file, key, i));
    made.at(i) = cv::Matx33d(one);
  }
  return made;
}

cv::Matx33d to_panorama(const ArkCalibration& calibration, std::size_t camera, const cv::Matx33d& K) {
  const cv::Matx33d scale(kPanorama_px, 0, 0, 0, kPanorama_px, 0, 0, 0, 1);
  return scale * calibration.R.at(camera) * K.inv();
}

/// A camera's picture in the panorama, as ARK's warper computes it.
cv::Rect placed(const ArkCalibration& calibration, std::size_t camera) {
  const cv::Matx33d warp = to_panorama(calibration, camera, calibration.K.at(camera));
  constexpr double kRight = kArkWidth_px - 1, kLower = kArkHeight_px - 1;
  double left = 1e9, top = 1e9, right = -1e9, bottom = -1e9;
  for (const cv::Point2d& corner : {cv::Point2d(0, 0), {kRight, 0}, {0, kLower}, {kRight, kLower}}) {
    const cv::Point2d at = through(warp, corner);
    left = std::min(left, at.x);
    right = std::max(right, at.x);
    top = std::min(top, at.y);
    bottom = std::max(bottom, at.y);
  }
  constexpr double kFarthest_px = 1e5;
  if (!(std::max({-left, -top, right, bottom}) < kFarthest_px))
    throw UserError(fmt::format("K and R of camera {} do not put its picture onto the panorama", camera));
  const int x = static_cast<int>(left), y = static_cast<int>(top);
  return {x, y, static_cast<int>(right) - x + 1, static_cast<int>(bottom) - y + 1};
}

/// The number and the camera of a name frame_%05d_%d.jpg.
std::optional<std::pair<int, std::size_t>> number_of(const fs::path& file) {
  const std::string name = file.filename().string();
  constexpr std::size_t kLength = 17;
  if (name.size() != kLength || !name.starts_with("frame_") || name[11] != '_' || !name.ends_with(".jpg"))
    return std::nullopt;
  int number = 0;
  for (const char c : name.substr(6, 5)) {
    if (c < '0' || c > '9') return std::nullopt;
    number = 10 * number + (c - '0');
  }
  if (name[12] < '0' || name[12] > '3') return std::nullopt;
  return std::pair{number, static_cast<std::size_t>(name[12] - '0')};
}

/// Numbers of frames that have a picture of camera 0; ascending.
std::vector<int> numbers_in(const fs::path& directory) {
  std::vector<int> numbers;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(directory, error)) {
    const auto number = number_of(entry.path());
    if (number && number->second == 0) numbers.push_back(number->first);
  }
  if (error) throw RunError(fmt::format("{}: cannot be read: {}", directory.string(), error.message()));
  std::sort(numbers.begin(), numbers.end());
  return numbers;
}

}  // namespace

std::optional<ArkCalibration> read_ark_calibration(const fs::path& file, const cv::Size2d& arena_mm) {
  const std::string name = file.string();
  try {
    const cv::FileStorage storage(name, cv::FileStorage::READ);
    if (!storage.isOpened()) throw UserError(fmt::format("{}: cannot be read", name));
    // A file of --calibrate has one K and one R, no lists.
    if (storage["K"].empty() || storage["R"].empty() || storage["corner1"].empty()) return std::nullopt;
    ArkCalibration calibration;
    calibration.K = square_matrices(storage, "K", name);
    calibration.R = square_matrices(storage, "R", name);
    if (!storage["exact_K"].empty()) calibration.exact_K = square_matrices(storage, "exact_K", name);
    calibration.lens_K = calibration.K;
    if (!storage["distortion"].empty() || !storage["lens_K"].empty()) {
      calibration.lens_K = square_matrices(storage, "lens_K", name);
      calibration.distortion = matrices(storage, "distortion", 4, name);
    }
    constexpr std::array<const char*, kArkCameras> kKeys{"corner1", "corner2", "corner3", "corner4"};
    for (std::size_t i = 0; i < kKeys.size(); ++i) {
      cv::Point2f corner;
      storage[kKeys.at(i)] >> corner;
      calibration.corners.at(i) = corner;
    }
    if (arena_mm.width <= 0 || arena_mm.height <= 0)
      throw UserError(fmt::format("{}: states no size of the arena; state it with --arena", name));
    calibration.arena_mm = arena_mm;
    return calibration;
  } catch (const cv::Exception& error) {
    throw UserError(fmt::format("{}:1:1: cannot be read: {}", name, error.err));
  }
}

ArkMosaic::ArkMosaic(const ArkCalibration& calibration) : calibration_(calibration) {
  lay_out();
  map_parts();
}

/// Where the floor is in each picture.
void ArkMosaic::lay_out() {
  cv::Rect full;
  for (std::size_t i = 0; i < kArkCameras; ++i) full |= placed(calibration_, i);
  if (calibration_.exact_K) {
    // Made for ARK's reckoning, which adds one.
    full.width += 1;
    full.height += 1;
  }
  const auto w = static_cast<float>(calibration_.arena_mm.width / 2),
             h = static_cast<float>(calibration_.arena_mm.height / 2);
  const std::vector<cv::Point2f> arena{{-w, h}, {w, h}, {-w, -h}, {w, -h}};
  const std::vector<cv::Point2f> corners(calibration_.corners.begin(), calibration_.corners.end());
  const cv::Matx33d to_shrunk(cv::getPerspectiveTransform(arena, corners));
  if (!(std::abs(cv::determinant(to_shrunk)) > 1e-12))
    throw UserError("corner1 to corner4 of the calibration are no four corners of an arena");
  // Shrinking keeps the picture's edges; coordinates are those of pixels' middles.
  const double fx = static_cast<double>(full.width) / kShrunk_px,
               fy = static_cast<double>(full.height) / kShrunk_px;
  const cv::Matx33d to_whole(fx, 0, 0.5 * fx - 0.5 + full.x, 0, fy, 0.5 * fy - 0.5 + full.y, 0, 0, 1);
  for (std::size_t i = 0; i < kArkCameras; ++i)
    to_ideal_.at(i) = to_panorama(calibration_, i, calibration_.exact_K.value_or(calibration_.K).at(i)).inv() *
                      to_whole * to_shrunk;
  // As many pixels per mm as the finest camera has in its middle.
  double px_per_mm = 0;
  for (std::size_t i = 0; i < kArkCameras; ++i) {
    const cv::Matx33d to_mm = to_ideal_.at(i).inv();
    const cv::Point2d middle(kArkWidth_px / 2.0, kArkHeight_px / 2.0);
    const double mm_per_px = cv::norm(through(to_mm, middle + cv::Point2d(1, 0)) - through(to_mm, middle));
    px_per_mm = std::max(px_per_mm, 1 / mm_per_px);
  }
  const double side_mm = std::max(calibration_.arena_mm.width, calibration_.arena_mm.height);
  px_per_mm = std::min(px_per_mm, kMostSide_px / side_mm);
  if (!(px_per_mm * side_mm > 64))
    throw UserError("the calibration puts the arena outside of the cameras' pictures");
  size_ = {cvRound(calibration_.arena_mm.width * px_per_mm), cvRound(calibration_.arena_mm.height * px_per_mm)};
  floor_ = FloorMap::scale(size_, 1 / px_per_mm);
}

Point ArkMosaic::in_camera(std::size_t camera, const FloorPoint& point) const {
  const cv::Point2d ideal = through(to_ideal_.at(camera), {point.x_mm, point.y_mm});
  const cv::Mat& distortion = calibration_.distortion.at(camera);
  if (distortion.empty()) return {ideal.x, ideal.y};
  const cv::Point2d seen = through(calibration_.lens_K.at(camera).inv(), ideal);
  const std::vector<cv::Point3d> rays{{seen.x, seen.y, 1}};
  std::vector<cv::Point2d> pixels;
  cv::projectPoints(rays, cv::Vec3d(), cv::Vec3d(), calibration_.lens_K.at(camera), distortion, pixels);
  return {pixels[0].x, pixels[0].y};
}

/// Decides which camera serves which part of the joined picture.
void ArkMosaic::map_parts() {
  cv::Mat best(size_, CV_32F, cv::Scalar(0)), whose(size_, CV_8U, cv::Scalar(kArkCameras));
  std::array<cv::Mat, kArkCameras> maps;
  for (std::size_t i = 0; i < kArkCameras; ++i) {
    maps.at(i).create(size_, CV_32FC2);
    for (int row = 0; row < size_.height; ++row) {
      // A row at once: the projection of single points costs much more.
      std::vector<cv::Point3d> rays;
      for (int column = 0; column < size_.width; ++column) {
        const FloorPoint at = floor_.floor({static_cast<double>(column), static_cast<double>(row)});
        const cv::Vec3d seen = calibration_.lens_K.at(i).inv() * (to_ideal_.at(i) * cv::Vec3d(at.x_mm, at.y_mm, 1));
        rays.emplace_back(seen[0], seen[1], seen[2]);
      }
      std::vector<cv::Point2d> pixels;
      cv::projectPoints(rays, cv::Vec3d(), cv::Vec3d(), calibration_.lens_K.at(i), calibration_.distortion.at(i),
                        pixels);
      for (int column = 0; column < size_.width; ++column) {
        const cv::Point2d& p = pixels[static_cast<std::size_t>(column)];
        maps.at(i).at<cv::Vec2f>(row, column) = {static_cast<float>(p.x), static_cast<float>(p.y)};
        const bool before = rays[static_cast<std::size_t>(column)].z > 0;
        const double inside = before ? std::min({p.x, p.y, kArkWidth_px - 1 - p.x, kArkHeight_px - 1 - p.y}) : -1.0;
        if (inside <= static_cast<double>(best.at<float>(row, column))) continue;
        best.at<float>(row, column) = static_cast<float>(inside);
        whose.at<unsigned char>(row, column) = static_cast<unsigned char>(i);
      }
    }
  }
  for (std::size_t i = 0; i < kArkCameras; ++i) {
    Part& part = parts_.at(i);
    const cv::Mat mine = whose == static_cast<int>(i);
    part.where = cv::boundingRect(mine);
    if (part.where.empty()) continue;
    part.mine = mine(part.where).clone();
    cv::convertMaps(maps.at(i)(part.where), cv::noArray(), part.xy, part.share, CV_16SC2);
  }
}

cv::Mat ArkMosaic::join(const std::array<cv::Mat, kArkCameras>& pictures) const {
  cv::Mat joined(size_, CV_8UC3, cv::Scalar::all(0)), piece;
  for (std::size_t i = 0; i < kArkCameras; ++i) {
    const cv::Mat& picture = pictures.at(i);
    if (picture.cols != kArkWidth_px || picture.rows != kArkHeight_px)
      throw UserError(fmt::format("camera {}: a picture of {}x{} pixels; ARK's have {}x{}", i, picture.cols,
                                  picture.rows, kArkWidth_px, kArkHeight_px));
    const Part& part = parts_.at(i);
    if (part.where.empty()) continue;
    cv::remap(picture, piece, part.xy, part.share, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
    piece.copyTo(joined(part.where), part.mine);
  }
  return joined;
}

bool is_ark_directory(const fs::path& directory) {
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(directory, ignored)) {
    if (number_of(entry.path())) return true;
  }
  return false;
}

ArkDirectory::ArkDirectory(fs::path directory, const SourceOptions& options, const ArkCalibration& calibration)
    : directory_(std::move(directory)), options_(options), mosaic_(calibration) {
  if (options_.watch) return;
  numbers_ = numbers_in(directory_);
  if (numbers_.empty())
    throw UserError(
        fmt::format("{}: holds no frame_00000_0.jpg or the like; expected pictures of ARK's four cameras, "
                    "or --watch to wait for them",
                    directory_.string()));
}

fs::path ArkDirectory::file(int number, std::size_t camera) const {
  return directory_ / fmt::format("frame_{:05}_{}.jpg", number, camera);
}

/// The next frame of which all pictures are there.
std::optional<int> ArkDirectory::next_number(const std::atomic<bool>& stop) {
  if (!options_.watch) {
    const auto next = std::upper_bound(numbers_.begin(), numbers_.end(), last_);
    if (next == numbers_.end()) return std::nullopt;
    return *next;
  }
  while (!stop) {
    const std::vector<int> numbers = numbers_in(directory_);
    for (auto next = std::upper_bound(numbers.begin(), numbers.end(), last_); next != numbers.end(); ++next) {
      bool all = true;
      for (std::size_t camera = 0; camera < kArkCameras; ++camera) all = all && fs::exists(file(*next, camera));
      if (all) return *next;
    }
    constexpr std::chrono::milliseconds kPause{4};
    std::this_thread::sleep_for(kPause);
  }
  return std::nullopt;
}

std::optional<CapturedFrame> ArkDirectory::next(const std::atomic<bool>& stop) {
  while (const std::optional<int> number = next_number(stop)) {
    last_ = *number;
    std::array<cv::Mat, kArkCameras> pictures;
    std::optional<cameras::FrameStamp> stamp;
    bool all = true;
    for (std::size_t camera = 0; camera < kArkCameras; ++camera) {
      StampedPicture read = read_stamped(file(*number, camera));
      pictures.at(camera) = read.picture;
      stamp = read.stamp;
      if (!pictures.at(camera).empty()) continue;
      // A directory that grows may replace its oldest files.
      all = false;
      if (!options_.watch)
        throw UserError(fmt::format("{}: is missing, or no picture that can be read; each frame needs four cameras",
                                    file(*number, camera).string()));
    }
    if (!all) continue;
    CapturedFrame frame{mosaic_.join(pictures), frames_, static_cast<double>(frames_) / options_.rate_hz, 0};
    if (options_.watch) clock_.time(frame, stamp);
    ++frames_;
    return frame;
  }
  return std::nullopt;
}

}  // namespace kilotwin::track
