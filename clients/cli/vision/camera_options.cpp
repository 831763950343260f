#include "clients/cli/vision/camera_options.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>

#include "core/base/error.hpp"

namespace kilotwin::cli {
namespace {

/// Floor beyond the walls that a picture of the whole arena shows.
constexpr double kMargin_mm = 40;
/// Bounds of a picture's width and height.
constexpr int kLeast_px = 16, kMost_px = 16384;

CLI::Range share() { return CLI::Range(0.0, 1.0); }

}  // namespace

void add_camera_options(CLI::App& app, CameraOptions& options) {
  const std::string group = "Camera";
  app.add_option("--size", options.size, "size of the picture")
      ->capture_default_str()
      ->type_name("WxH")
      ->group(group);
  app.add_option("--scale", options.px_per_mm, "pixels per mm (default: the whole arena)")
      ->check(CLI::PositiveNumber.description(""))
      ->type_name("PX_PER_MM")
      ->group(group);
  app.add_option("--lens", options.lens, "distortion of the lens: K1,K2,P1,P2,K3 in OpenCV's order; fewer do")
      ->delimiter(',')
      ->expected(1, 5)
      ->type_name("K1,K2,...")
      ->group(group);
  app.add_option("--exposure", options.model.exposure_s, "exposure in simulated time, s: smears what moves")
      ->check(CLI::Range(0.0, 10.0).description(""))
      ->type_name("S")
      ->group(group);
  app.add_option("--blur", options.model.blur_px, "standard deviation of the lens' blur, px")
      ->check(CLI::Range(0.0, 20.0).description(""))
      ->type_name("PX")
      ->group(group);
  app.add_option("--noise", options.model.read_noise, "standard deviation of noise in the dark, of 255 levels")
      ->check(CLI::Range(0.0, 100.0).description(""))
      ->type_name("LEVELS")
      ->group(group);
  app.add_option("--shot-noise", options.model.shot_noise, "standard deviation of further noise at full brightness")
      ->check(CLI::Range(0.0, 100.0).description(""))
      ->type_name("LEVELS")
      ->group(group);
  app.add_option("--vignetting", options.model.vignetting, "share of light that is lost in the corners, 0 to 1")
      ->check(share().description(""))
      ->type_name("SHARE")
      ->group(group);
  app.add_option("--uneven-light", options.model.uneven_light,
                 "share by which room light differs 1 m from the centre, 0 to 1")
      ->check(share().description(""))
      ->type_name("SHARE")
      ->group(group);
  app.add_option("--shadow", options.look.shadow, "depth of the robots' soft shadows, 0 to 1")
      ->check(share().description(""))
      ->type_name("SHARE")
      ->group(group);
  app.add_option("--body-height", options.look.body_height_mm,
                 "height of the robots' upper side above the floor, which shifts them towards the picture's rim")
      ->check(CLI::Range(0.0, 200.0).description(""))
      ->type_name("MM")
      ->group(group);
  app.add_option("--noise-seed", options.model.seed, "random seed of the noise")->type_name("N")->group(group);
}

cameras::CameraModel model_of(const CameraOptions& options) {
  cameras::CameraModel model = options.model;
  double* const coefficients[] = {&model.distortion.k1, &model.distortion.k2, &model.distortion.p1,
                                  &model.distortion.p2, &model.distortion.k3};
  for (std::size_t i = 0; i < options.lens.size(); ++i) *coefficients[i] = options.lens[i];
  return model;
}

cameras::CameraModel big_camera(const CameraOptions& options, const World& world) {
  int width = 0, height = 0;
  const char* const last = options.size.data() + options.size.size();
  const auto [middle, error] = std::from_chars(options.size.data(), last, width);
  const bool has_x = error == std::errc() && middle != last && *middle == 'x';
  const auto [end, second_error] = std::from_chars(has_x ? middle + 1 : last, last, height);
  if (!has_x || second_error != std::errc() || end != last || width < kLeast_px || height < kLeast_px ||
      width > kMost_px || height > kMost_px)
    throw UserError(fmt::format("--size: \"{}\" is no size; give WIDTHxHEIGHT, each {} to {}, such as 1920x1080",
                                options.size, kLeast_px, kMost_px));
  const double fit = std::min(width / (2 * (world.arena.half_width_mm() + kMargin_mm)),
                              height / (2 * (world.arena.half_height_mm() + kMargin_mm)));
  cameras::CameraModel model = model_of(options);
  const cameras::CameraModel overhead =
      cameras::CameraModel::overhead(width, height, options.px_per_mm > 0 ? options.px_per_mm : fit);
  model.width_px = width;
  model.height_px = height;
  model.K = overhead.K;
  model.R = overhead.R;
  model.position_mm = overhead.position_mm;
  return model;
}

std::string camera_xml(const cameras::CameraModel& camera) {
  cv::FileStorage file("camera.xml", cv::FileStorage::WRITE | cv::FileStorage::MEMORY);
  const cameras::Distortion& d = camera.distortion;
  file << "width" << camera.width_px << "height" << camera.height_px << "K" << cv::Mat(camera.K) << "distortion"
       << (cv::Mat_<double>(1, 5) << d.k1, d.k2, d.p1, d.p2, d.k3) << "R" << cv::Mat(camera.R) << "position_mm"
       << cv::Mat(camera.position_mm);
  return file.releaseAndGetString();
}

}  // namespace kilotwin::cli
