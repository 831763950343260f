#include "core/senses/light_image.hpp"

#include "core/base/error.hpp"
#include "core/math/elementary.h"
#include "core/plan/senses_settings.hpp"

namespace kilotwin::senses {

LightImage::LightImage(const LightImageSettings& image)
    : width_mm_(image.width_mm), height_mm_(image.height_mm), picture_s_(image.picture_s), loop_(image.loop) {
  left_mm_ = image.x_mm - width_mm_ / 2;
  top_mm_ = image.y_mm + height_mm_ / 2;
  for (const LightRaster& raster : image.pictures) {
    KILOTWIN_DEMAND(raster.columns > 0 && raster.rows > 0 &&
                    raster.brightness.size() == std::size_t{raster.columns} * raster.rows);
    rasters_.push_back({raster.columns, raster.rows, raster.brightness.data()});
  }
  for (int i = 0; i < 256; ++i) {
    reading_of_[static_cast<std::size_t>(i)] =
        image.black + (image.white - image.black) * kt_pow(i / 255.0, image.gamma);
  }
}

void LightImage::at(double time_s) {
  const double picture = kt_floor(time_s / picture_s_);
  const auto count = static_cast<double>(rasters_.size());
  shown_ = static_cast<std::size_t>(loop_ ? kt_fmod(picture, count) : picture < count ? picture : count - 1);
}

double LightImage::reading(double x_mm, double y_mm) const {
  const Raster& raster = rasters_[shown_];
  // x and y become pixel coordinates from the left and from the top, with the centre of the first pixel at 0.
  double x = (x_mm - left_mm_) / width_mm_, y = (top_mm_ - y_mm) / height_mm_;
  if (!(x >= 0 && x <= 1 && y >= 0 && y <= 1)) return 0;
  x = x * raster.columns - 0.5;
  y = y * raster.rows - 0.5;
  const auto cell = [](double at, std::uint32_t count, std::uint32_t& low, std::uint32_t& high) {
    at = at < 0 ? 0 : at > count - 1 ? count - 1 : at;
    low = static_cast<std::uint32_t>(at);
    high = low + 1 < count ? low + 1 : low;
    return at - low;
  };
  std::uint32_t x0 = 0, x1 = 0, y0 = 0, y1 = 0;
  const double fx = cell(x, raster.columns, x0, x1), fy = cell(y, raster.rows, y0, y1);
  const auto value = [&](std::uint32_t column, std::uint32_t row) {
    return reading_of_[static_cast<std::uint8_t>(raster.brightness[std::size_t{row} * raster.columns + column])];
  };
  const double top = value(x0, y0) + fx * (value(x1, y0) - value(x0, y0));
  const double bottom = value(x0, y1) + fx * (value(x1, y1) - value(x0, y1));
  return top + fy * (bottom - top);
}

}  // namespace kilotwin::senses
