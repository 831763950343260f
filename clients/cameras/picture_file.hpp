/// Pictures as files in memory, JPEG or PNG, that carry the time of their capture.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace kilotwin::cameras {

/// The content of a picture, and when it was taken.
struct FrameStamp {
  std::uint64_t frame = 0;  ///< of this camera, counted from 0
  std::uint64_t run = 0;
  std::int64_t tick = 0;
  double simulated_s = 0;
  std::int64_t capture_ns = 0;  ///< middle of the exposure: UTC, since 1970

  /// "kilotwin frame=0 run=0123456789abcdef tick=12 simulated_s=0.393216 capture_ns=..."
  [[nodiscard]] std::string text() const;
};

enum class PictureFormat : std::uint8_t { kJpeg, kPng };

/// By the ending of a name: .jpg, .jpeg, .png; nothing for others.
[[nodiscard]] std::optional<PictureFormat> format_of(std::string_view name);

/// The stamp is a comment segment of a JPEG, or a text chunk `Comment` of a PNG; every viewer passes over it. `quality`: of a
/// JPEG, 1..100.
[[nodiscard]] std::string encoded(const cv::Mat& picture, PictureFormat format, const FrameStamp& stamp,
                                  int quality = 90);

/// The stamp of such a file; nothing where it has none.
[[nodiscard]] std::optional<FrameStamp> stamp_of(std::string_view file);

}  // namespace kilotwin::cameras
