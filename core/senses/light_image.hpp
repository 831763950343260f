/// A projector: a sequence of pictures on the arena's floor.
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
  /// The settings must outlive this object, because it reads their pixels.
  explicit LightImage(const LightImageSettings&);

  /// Chooses the picture that is shown at `time_s`.
  void at(double time_s);
  /// Reading of a nominal sensor at a point, counts, between the settings' `black` and `white`. Bilinear between the centres of
  /// pixels, constant between the outermost centres and the edge, 0 outside the picture.
  [[nodiscard]] double reading(double x_mm, double y_mm) const;

 private:
  struct Raster {
    std::uint32_t columns = 0, rows = 0;
    const char* brightness = nullptr;  ///< 0..255, row by row from the top; owned by the settings
  };
  std::vector<Raster> rasters_;
  std::array<double, 256> reading_of_{};  ///< per brightness
  double left_mm_, top_mm_, width_mm_, height_mm_, picture_s_;
  bool loop_;
  std::size_t shown_ = 0;
};

}  // namespace kilotwin::senses
