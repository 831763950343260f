#include "tests/clients/track/drawn_scene.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <random>

namespace kilotwin::track {
namespace {

constexpr int kFine = 4;  ///< pixels of the drawing per pixel of the picture

cv::Point fine(double x, double y) { return {cvRound((x + 0.5) * kFine - 0.5), cvRound((y + 0.5) * kFine - 0.5)}; }
int fine(double length) { return std::max(1, cvRound(length * kFine)); }

cv::Scalar colour_of(Led led) {
  const std::uint8_t bits = bits_of(led);
  return {255.0 * ((bits >> 4) & 1), 255.0 * ((bits >> 2) & 1), 255.0 * (bits & 1)};
}

void draw_body(cv::Mat& canvas, const DrawnRobot& robot, std::mt19937_64& random) {
  const auto [centre, r] = robot.disc;
  cv::circle(canvas, fine(centre.x_px, centre.y_px), fine(r), cv::Scalar(40, 44, 42), cv::FILLED, cv::LINE_AA);
  const double shade = std::uniform_real_distribution(60.0, 150.0)(random);
  cv::circle(canvas, fine(centre.x_px, centre.y_px), fine(0.68 * r), cv::Scalar(shade, shade, 0.96 * shade),
             cv::FILLED, cv::LINE_AA);
  // The reflection of a lamp in the dome.
  cv::circle(canvas, fine(centre.x_px + 0.1 * r, centre.y_px - 0.1 * r), fine(0.09 * r), cv::Scalar(235, 238, 236),
             cv::FILLED, cv::LINE_AA);
}

void draw_clutter(cv::Mat& canvas, int count, std::mt19937_64& random) {
  std::uniform_real_distribution x(0.0, static_cast<double>(canvas.cols)), y(0.0, static_cast<double>(canvas.rows));
  std::uniform_real_distribution grey(20.0, 120.0), part(0.0, 1.0);
  for (int i = 0; i < count; ++i) {
    const double g = grey(random);
    const cv::Scalar colour(g, g, g * 1.1);
    const cv::Point a(cvRound(x(random)), cvRound(y(random)));
    if (i % 3 == 0) {
      cv::line(canvas, a, {cvRound(x(random)), cvRound(y(random))}, colour, fine(3), cv::LINE_AA);
    } else if (i % 3 == 1) {
      cv::ellipse(canvas, a, {fine(20 + 60 * part(random)), fine(15 + 60 * part(random))}, 360 * part(random), 0,
                  120 + 180 * part(random), colour, fine(2), cv::LINE_AA);
    } else {
      cv::rectangle(canvas, {a, cv::Size(fine(20 + 60 * part(random)), fine(15 + 40 * part(random)))}, colour,
                    cv::FILLED);
    }
  }
}

void add_light(cv::Mat& picture, const DrawnRobot& robot) {
  if (robot.led == Led::kOff) return;
  const double r = robot.disc.radius_px;
  const double x = robot.disc.centre.x_px + 0.9 * r * std::cos(robot.led_bearing_rad);
  const double y = robot.disc.centre.y_px - 0.9 * r * std::sin(robot.led_bearing_rad);
  const cv::Scalar colour = colour_of(robot.led);
  const int reach = cvCeil(1.5 * r);
  for (int row = std::max(0, cvFloor(y) - reach); row < std::min(picture.rows, cvCeil(y) + reach); ++row) {
    for (int column = std::max(0, cvFloor(x) - reach); column < std::min(picture.cols, cvCeil(x) + reach);
         ++column) {
      const double off = std::hypot(column - x, row - y) / r;
      const double core = 1.6 * std::exp(-off * off / (2 * 0.13 * 0.13));
      const double glow = 0.3 * std::exp(-off * off / (2 * 0.3 * 0.3));
      auto& p = picture.at<cv::Vec3f>(row, column);
      for (int k = 0; k < 3; ++k) p[k] += static_cast<float>((core + glow) * colour[k] + 0.25 * core * 255);
    }
  }
}

}  // namespace

cv::Mat draw(const DrawnScene& scene) {
  std::mt19937_64 random(scene.seed);
  cv::Mat canvas(scene.height_px * kFine, scene.width_px * kFine, CV_8UC3,
                 cv::Scalar(scene.floor[0], scene.floor[1], scene.floor[2]));
  draw_clutter(canvas, scene.clutter, random);
  for (const DrawnRobot& robot : scene.robots) draw_body(canvas, robot, random);
  cv::Mat picture;
  cv::resize(canvas, picture, cv::Size(scene.width_px, scene.height_px), 0, 0, cv::INTER_AREA);
  picture.convertTo(picture, CV_32FC3);
  if (scene.uneven != 0) {
    for (int row = 0; row < picture.rows; ++row) {
      for (int column = 0; column < picture.cols; ++column)
        picture.at<cv::Vec3f>(row, column) *=
            static_cast<float>(1 + scene.uneven * (1 - 2.0 * column / (picture.cols - 1)));
    }
  }
  for (const DrawnRobot& robot : scene.robots) add_light(picture, robot);
  if (scene.blur_px > 0) cv::GaussianBlur(picture, picture, cv::Size(), scene.blur_px);
  if (scene.noise > 0) {
    cv::Mat noise(picture.size(), CV_32FC3);
    cv::RNG source(scene.seed);
    source.fill(noise, cv::RNG::NORMAL, 0, scene.noise);
    picture += noise;
  }
  picture.convertTo(picture, CV_8UC3);
  return picture;
}

std::vector<DrawnRobot> scatter(const DrawnScene& scene, int count, double radius_px, bool touching) {
  std::mt19937_64 random(scene.seed * 7919 + 17);
  const double margin = 1.15 * radius_px;
  std::uniform_real_distribution x(margin, scene.width_px - margin), y(margin, scene.height_px - margin);
  std::uniform_real_distribution angle(-std::numbers::pi, std::numbers::pi);
  std::uniform_int_distribution led(0, 7);
  std::vector<DrawnRobot> robots;
  const auto add = [&](double at_x, double at_y) {
    const bool inside =
        at_x > margin && at_y > margin && at_x < scene.width_px - margin && at_y < scene.height_px - margin;
    const bool free = std::none_of(robots.begin(), robots.end(), [&](const DrawnRobot& other) {
      return std::hypot(other.disc.centre.x_px - at_x, other.disc.centre.y_px - at_y) < 2.0 * radius_px - 1e-6;
    });
    if (!inside || !free || static_cast<int>(robots.size()) >= count) return;
    robots.push_back({{{at_x, at_y}, radius_px}, static_cast<Led>(led(random)), angle(random)});
  };
  for (int tries = 0; tries < 4000 && static_cast<int>(robots.size()) < count; ++tries) {
    const double at_x = x(random), at_y = y(random);
    add(at_x, at_y);
    if (!touching) continue;
    const double turn = angle(random);
    for (int i = 0; i < 6; ++i) {
      const double direction = turn + std::numbers::pi * i / 3;
      add(at_x + 2.0 * radius_px * std::cos(direction), at_y + 2.0 * radius_px * std::sin(direction));
    }
  }
  return robots;
}

}  // namespace kilotwin::track
