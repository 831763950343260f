#include "clients/track/brightness.hpp"

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace kilotwin::track {

cv::Mat grey_of(const cv::Mat& picture) {
  if (picture.channels() == 1) return picture;
  cv::Mat grey;
  cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
  return grey;
}

const cv::Mat& log_table() {
  static const cv::Mat table = [] {
    cv::Mat made(1, 256, CV_32F);
    for (int v = 0; v < 256; ++v) made.at<float>(0, v) = std::log(static_cast<float>(v) + 12.0F);
    return made;
  }();
  return table;
}

}  // namespace kilotwin::track
