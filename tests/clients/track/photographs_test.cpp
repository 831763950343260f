// The two photographs of real robots, against what a person sees in them. They are not part of the project.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <utility>
#include <vector>

#include "clients/track/brightness.hpp"
#include "clients/track/detect.hpp"
#include "clients/track/led.hpp"

namespace kilotwin::track {
namespace {

/// A robot by eye, px.
struct Marked {
  double x_px, y_px;
  char led;  ///< o: off; r, g, b, m (magenta or violet), w (white, or too bright to tell); ?: by eye not to be told
};

const std::vector<Marked> kDesk{{880, 541, 'w'}, {757, 672, 'o'},  {800, 798, 'w'},
                                {973, 777, 'g'}, {1030, 793, 'g'}, {960, 845, 'g'}};

const std::vector<Marked> kFifty{
    {95, 29, 'o'},   {165, 17, 'g'},  {101, 68, '?'},  {132, 69, 'r'},  {153, 88, 'm'},  {42, 140, 'r'},
    {152, 157, 'r'}, {148, 174, 'm'}, {109, 183, 'm'}, {178, 175, 'b'}, {189, 187, 'g'}, {232, 14, 'r'},
    {320, 40, 'b'},  {302, 60, 'g'},  {332, 93, 'b'},  {237, 115, 'm'}, {290, 116, 'r'}, {420, 176, 'o'},
    {241, 190, 'r'}, {218, 197, 'r'}, {11, 207, 'm'},  {28, 210, 'm'},  {12, 226, 'g'},  {12, 243, 'm'},
    {88, 209, '?'},  {92, 228, 'm'},  {155, 228, 'g'}, {186, 221, 'b'}, {206, 210, 'o'}, {127, 254, 'b'},
    {129, 298, 'o'}, {201, 302, 'r'}, {100, 364, 'm'}, {238, 206, 'b'}, {418, 200, 'b'}, {344, 213, 'b'},
    {217, 245, 'b'}, {246, 256, 'm'}, {255, 277, 'o'}, {243, 293, 'b'}, {218, 300, 'r'}, {252, 322, 'm'},
    {223, 350, 'r'}, {241, 349, 'r'}, {227, 370, 'r'}, {386, 251, 'b'}, {391, 268, 'b'}, {420, 256, 'm'},
    {383, 296, 'm'}, {372, 309, 'g'}};

struct Score {
  int found = 0, wrong = 0, leds = 0, leds_right = 0;
};

char letter_of(Led led) {
  switch (led) {
    case Led::kOff: return 'o';
    case Led::kRed: return 'r';
    case Led::kGreen: return 'g';
    case Led::kBlue: return 'b';
    case Led::kMagenta: return 'm';
    case Led::kWhite: return 'w';
    case Led::kCyan: return 'c';
    case Led::kYellow: return 'y';
  }
  return ' ';
}

Score score(const cv::Mat& picture, const std::vector<Marked>& truth) {
  Detector detector;
  const std::vector<Detection> found = detector.find(grey_of(picture));
  Score result;
  std::vector<bool> used(found.size(), false);
  for (const Marked& robot : truth) {
    for (std::size_t i = 0; i < found.size(); ++i) {
      const Circle& disc = found[i].disc;
      if (used[i] ||
          std::hypot(disc.centre.x_px - robot.x_px, disc.centre.y_px - robot.y_px) > 0.35 * disc.radius_px)
        continue;
      used[i] = true;
      ++result.found;
      if (robot.led == '?') break;
      std::vector<Circle> others;
      for (std::size_t j = 0; j < found.size(); ++j) {
        if (j != i) others.push_back(found[j].disc);
      }
      ++result.leds;
      const char led = letter_of(read_led(picture, disc, others).led);
      if (led == robot.led) ++result.leds_right;
      break;
    }
  }
  for (const bool of_robot : used) result.wrong += of_robot ? 0 : 1;
  return result;
}

void print(const char* photograph, const Score& s, std::size_t robots) {
  std::printf("photograph, %s: %d of %zu robots found, %d wrong; LED as by eye: %d of %d\n", photograph, s.found,
              robots, s.wrong, s.leds_right, s.leds);
}

cv::Mat photograph(const std::string& name) {
  return cv::imread((std::filesystem::path(KILOTWIN_SOURCES) / "../shared/data/images" / name).string());
}

TEST(Photographs, SixRobotsOnADeskAndNothingElse) {
  const cv::Mat picture = photograph("six-robots-on-a-desk.png");
  if (picture.empty())
    GTEST_SKIP() << "there is no ../shared/data/images: the photographs are not part of the project";
  const Score result = score(picture, kDesk);
  print("six on a desk, radius 24 px", result, kDesk.size());
  EXPECT_EQ(result.found, 6);
  EXPECT_EQ(result.wrong, 0);
  // One of the saturated LEDs has a glow between green and cyan.
  EXPECT_GE(result.leds_right, 5);
}

TEST(Photographs, FiftySmallRobots) {
  const cv::Mat picture = photograph("fifty-robots-led.png");
  if (picture.empty())
    GTEST_SKIP() << "there is no ../shared/data/images: the photographs are not part of the project";
  ASSERT_EQ(kFifty.size(), 50u);
  const Score result = score(picture, kFifty);
  print("fifty, radius 7 px", result, kFifty.size());
  EXPECT_GE(result.found, 48);
  EXPECT_LE(result.wrong, 0);
  EXPECT_GE(result.leds_right, 42) << "of " << result.leds;
}

}  // namespace
}  // namespace kilotwin::track
