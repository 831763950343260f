// Encoded pictures carry their stamp, and stay pictures.
#include "clients/cameras/picture_file.hpp"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <random>
#include <vector>

namespace kilotwin::cameras {
namespace {

cv::Mat decoded(const std::string& file) {
  return cv::imdecode(std::vector<std::uint8_t>(file.begin(), file.end()), cv::IMREAD_COLOR);
}

cv::Mat gradient() {
  cv::Mat picture(60, 80, CV_8UC3);
  for (int row = 0; row < picture.rows; ++row) {
    for (int column = 0; column < picture.cols; ++column)
      picture.at<cv::Vec3b>(row, column) = {static_cast<std::uint8_t>(3 * column),
                                            static_cast<std::uint8_t>(4 * row), 90};
  }
  return picture;
}

const FrameStamp kStamp{17, 0x0123456789abcdefu, 4711, 154.368, 1795400000123456789};

TEST(PictureFile, BothFormatsCarryTheStampAndDecode) {
  for (const PictureFormat format : {PictureFormat::kJpeg, PictureFormat::kPng}) {
    const std::string file = encoded(gradient(), format, kStamp, 95);
    const std::optional<FrameStamp> stamp = stamp_of(file);
    ASSERT_TRUE(stamp);
    EXPECT_EQ(stamp->text(), kStamp.text());
    EXPECT_EQ(stamp->capture_ns, kStamp.capture_ns);
    const cv::Mat picture = decoded(file);
    ASSERT_EQ(picture.size(), gradient().size());
    EXPECT_LE(cv::norm(picture, gradient(), cv::NORM_INF), format == PictureFormat::kPng ? 0 : 12);
  }
}

TEST(PictureFile, AStampIsReadWhateverBytesFollowIt) {
  // A PNG has the checksum of the stamp behind it, whose first byte is a digit for some stamps.
  FrameStamp stamp = kStamp;
  for (int i = 0; i < 500; ++i) {
    ++stamp.capture_ns;
    const std::optional<FrameStamp> read =
        stamp_of(encoded(cv::Mat::zeros(2, 2, CV_8UC3), PictureFormat::kPng, stamp));
    ASSERT_TRUE(read) << i;
    ASSERT_EQ(read->capture_ns, stamp.capture_ns);
  }
}

TEST(PictureFile, FilesWithoutAStampHaveNone) {
  std::vector<std::uint8_t> plain;
  ASSERT_TRUE(cv::imencode(".jpg", gradient(), plain));
  EXPECT_FALSE(stamp_of(std::string(plain.begin(), plain.end())));
  EXPECT_FALSE(stamp_of(""));
  EXPECT_FALSE(stamp_of("kilotwin frame="));
  // Random bytes and mutated stamps.
  std::mt19937_64 random(3);
  const std::string file = encoded(gradient(), PictureFormat::kJpeg, kStamp);
  for (int i = 0; i < 20000; ++i) {
    std::string mutated = file.substr(0, 200);
    for (int change = 0; change < 4; ++change) mutated[random() % mutated.size()] = static_cast<char>(random());
    static_cast<void>(stamp_of(mutated));
  }
}

TEST(PictureFile, FormatsAreKnownByTheirEndings) {
  EXPECT_EQ(format_of("a/b.jpg"), PictureFormat::kJpeg);
  EXPECT_EQ(format_of("b.jpeg"), PictureFormat::kJpeg);
  EXPECT_EQ(format_of("b.png"), PictureFormat::kPng);
  EXPECT_FALSE(format_of("b.gif"));
}

}  // namespace
}  // namespace kilotwin::cameras
