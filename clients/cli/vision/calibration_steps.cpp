#include "clients/cli/vision/calibration_steps.hpp"

#include <fmt/format.h>

#include <atomic>
#include <charconv>
#include <memory>
#include <vector>

#include "clients/track/source.hpp"
#include "core/base/error.hpp"

namespace kilotwin::cli {

cv::Size2d two_numbers(const std::string& option, const std::string& text) {
  const char* const end = text.data() + text.size();
  double first = 0, second = 0;
  const auto [middle, error] = std::from_chars(text.data(), end, first);
  if (error == std::errc() && middle != end && *middle == 'x') {
    const auto [last, second_error] = std::from_chars(middle + 1, end, second);
    if (second_error == std::errc() && last == end && first > 0 && second > 0) return {first, second};
  }
  throw UserError(fmt::format("{} {}: expected two numbers above 0, as 9x6", option, text));
}

void calibrate_from(const std::string& source, const track::Board& board, double disc_height_mm,
                    const std::filesystem::path& file) {
  constexpr std::size_t kMost = 40;
  const std::unique_ptr<track::Source> pictures_of = track::open_source(source, {});
  const std::atomic<bool> stop{false};
  std::vector<cv::Mat> pictures;
  while (pictures.size() < kMost) {
    std::optional<track::CapturedFrame> frame = pictures_of->next(stop);
    if (!frame) break;
    pictures.push_back(frame->picture);
  }
  const track::Calibration calibration = track::calibrate(pictures, board, disc_height_mm);
  track::write_calibration(calibration, file);
  fmt::print("{}: {}, from {} of {} pictures; residual {:.2f} px, {:.2f} mm on the floor\n", file.string(),
             calibration.map.camera_pose() ? "lens and pose" : "a plane without lens", calibration.pictures,
             pictures.size(), calibration.residual_px, calibration.residual_mm);
}

}  // namespace kilotwin::cli
