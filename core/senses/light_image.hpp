/// A projector's pictures on the arena's floor, as light.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace kilotwin {
struct LightImageSettings;
}

namespace kilotwin::senses {

class LightImage {
 public:
  /// The settings must outlive this object, which reads their pictures.
  explicit LightImage(const LightImageSettings&);

  /// Chooses the picture of an instant.
  void at(double time_s);
  /// The reading of a nominal sensor there, counts, between those of black and white; interpolated between the centres of
  /// pixels, even beyond the outermost ones. 0 outside the picture.
  [[nodiscard]] double reading(double x_mm, double y_mm) const;

 private:
  struct Raster {
    std::uint32_t columns = 0, rows = 0;
    const char* brightness = nullptr;  ///< row by row from the top, 0..255; of the settings
  };
  std::vector<Raster> rasters_;
  std::array<double, 256> reading_of_{};  ///< per brightness
  double left_mm_, top_mm_, width_mm_, height_mm_, picture_s_;
  bool loop_;
  std::size_t shown_ = 0;
};

}  // namespace kilotwin::senses
