/// A projector's pictures on the arena's floor, as light.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "idl/manifest.pb.h"

namespace kilotwin::senses {

class LightImage {
 public:
  /// `rasters`: the manifest's, of which the image takes as many as it names pictures, from `first` on.
  LightImage(const proto::LightImage&, const proto::Manifest&, int first);

  /// Chooses the picture of an instant.
  void at(double time_s);
  /// The reading of a nominal sensor there, counts, between those of black and white; interpolated between the centres of
  /// pixels, even beyond the outermost ones. 0 outside the picture.
  [[nodiscard]] double reading(double x_mm, double y_mm) const;

 private:
  struct Raster {
    std::uint32_t columns = 0, rows = 0;
    const char* brightness = nullptr;  ///< row by row from the top, 0..255; the manifest's own
  };
  std::vector<Raster> rasters_;
  std::array<double, 256> reading_of_{};  ///< per brightness
  double left_mm_, top_mm_, width_mm_, height_mm_, picture_s_;
  bool loop_;
  std::size_t shown_ = 0;
};

}  // namespace kilotwin::senses
