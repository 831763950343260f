/// Brightness as the search for discs sees it.
#pragma once

#include <opencv2/core.hpp>

namespace kilotwin::track {

/// The brightness of a picture of 1 or 3 channels (blue, green, red) as 8 bits.
[[nodiscard]] cv::Mat grey_of(const cv::Mat& picture);

/// log(v + 12) for the brightness v = 0..255, for cv::LUT. The addend keeps noise of dark places from being taken for contrast.
[[nodiscard]] const cv::Mat& log_table();

}  // namespace kilotwin::track
