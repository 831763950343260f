#include "core/experiment/surroundings.hpp"

#include <fmt/format.h>
#include <png.h>

#include <fstream>
#include <iterator>

#include "core/base/eeprom_layout.h"
#include "core/base/error.hpp"
#include "core/experiment/kilogrid.hpp"

namespace kilotwin {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMostPixels = 64u << 20;  // per picture

class Check {
 public:
  explicit Check(const LoadedExperiment& loaded) : loaded_(loaded) {}

  void source(const proto::LightSource& source, const std::string& path) const {
    if (source.has_circle() && source.waypoint_size() > 0)
      fail(path, "a source has both circle and waypoint; it moves in one way or the other");
    double before_s = -1;
    for (int i = 0; i < source.waypoint_size(); ++i) {
      const proto::LightWaypoint& point = source.waypoint(i);
      const std::string at = fmt::format("{}.waypoint[{}]", path, i);
      if (!point.has_time_s() || !point.has_x_mm() || !point.has_y_mm())
        fail(at, "time_s, x_mm or y_mm is missing; a way-point needs all three");
      if (point.time_s() <= before_s)
        fail(at, "time_s is not later than that of the previous way-point; put them in order");
      before_s = point.time_s();
    }
    before_s = -1;
    for (int i = 0; i < source.switch_s_size(); ++i) {
      const std::string at = fmt::format("{}.switch_s[{}]", path, i);
      if (source.switch_s(i) <= before_s)
        fail(at, "switch_s is not later than the previous one; put them in order");
      before_s = source.switch_s(i);
    }
    if (source.switch_period_s() > 0 && before_s >= source.switch_period_s())
      fail(path + ".switch_period_s", "switch_period_s is not longer than the last of switch_s; make it longer");
  }

  void image(const proto::LightImage& image, const std::string& path) const {
    if (image.png_size() == 0) fail(path, "png is missing; state png: \"FILE.png\"");
  }

  [[noreturn]] void fail(const std::string& path, const std::string& what) const {
    throw loaded_.locations.error(path, what);
  }

 private:
  const LoadedExperiment& loaded_;
};

proto::LightRaster read_png(const fs::path& file, std::string& wrong) {
  proto::LightRaster raster;
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_file(&image, file.c_str()) == 0) {
    wrong = image.message;
    return raster;
  }
  image.format = PNG_FORMAT_GRAY;  // 8 bits, transparency on black
  if (std::uint64_t{image.width} * image.height > kMostPixels) {
    png_image_free(&image);
    wrong = "it has more than 64 million pixels";
    return raster;
  }
  std::string brightness(PNG_IMAGE_SIZE(image), '\0');
  const png_color black{0, 0, 0};
  if (png_image_finish_read(&image, &black, brightness.data(), 0, nullptr) == 0) {
    wrong = image.message;
    return raster;
  }
  raster.set_columns(image.width);
  raster.set_rows(image.height);
  raster.set_brightness(std::move(brightness));
  return raster;
}

}  // namespace

void check_surroundings(const LoadedExperiment& loaded) {
  const Check check(loaded);
  const proto::Light& light = loaded.experiment.light();
  for (int i = 0; i < light.source_size(); ++i) check.source(light.source(i), fmt::format("light.source[{}]", i));
  for (int i = 0; i < light.image_size(); ++i) check.image(light.image(i), fmt::format("light.image[{}]", i));
}

std::vector<proto::LightRaster> read_light_rasters(const LoadedExperiment& loaded) {
  std::vector<proto::LightRaster> rasters;
  const proto::Light& light = loaded.experiment.light();
  for (int i = 0; i < light.image_size(); ++i) {
    for (int k = 0; k < light.image(i).png_size(); ++k) {
      const fs::path file = loaded.resolve(light.image(i).png(k));
      std::string wrong;
      rasters.push_back(read_png(file, wrong));
      if (wrong.empty()) continue;
      throw loaded.locations.error(fmt::format("light.image[{}].png[{}]", i, k),
                                   fmt::format("{} cannot be read: {}; name a PNG picture, relative to the "
                                               "experiment file",
                                               file.string(), wrong));
    }
  }
  return rasters;
}

std::vector<proto::RobotEeprom> read_eeproms(const LoadedExperiment& loaded,
                                             const std::vector<std::uint32_t>& counts) {
  std::vector<proto::RobotEeprom> eeproms;
  std::uint32_t first = 0;
  for (int g = 0; g < loaded.experiment.robots_size(); ++g) {
    const proto::RobotGroup& group = loaded.experiment.robots(g);
    const std::uint32_t count = counts[static_cast<std::size_t>(g)];
    if (group.has_cells()) {
      for (proto::RobotEeprom& eeprom : cell_eeproms(loaded, g, first, count)) eeproms.push_back(std::move(eeprom));
    }
    if (group.has_eeprom()) {
      const auto fail = [&](const std::string& what) {
        return loaded.locations.error(fmt::format("robots[{}].eeprom", g), what);
      };
      const fs::path directory = loaded.resolve(group.eeprom());
      std::error_code ignored;
      if (!fs::is_directory(directory, ignored))
        throw fail(fmt::format("there is no directory {}; name one that holds files N.eeprom", directory.string()));
      for (std::uint32_t i = 0; i < count; ++i) {
        const fs::path file = directory / fmt::format("{}.eeprom", i);
        std::ifstream in(file, std::ios::binary);
        if (!in) continue;
        const std::string content((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
        if (content.size() != KILOTWIN_EEPROM_OCTETS) {
          throw fail(fmt::format("{} has {} octets; an EEPROM has {}", file.string(), content.size(),
                                 int{KILOTWIN_EEPROM_OCTETS}));
        }
        proto::RobotEeprom& eeprom = eeproms.emplace_back();
        eeprom.set_robot(first + i);
        eeprom.set_content(content);
      }
    }
    first += count;
  }
  return eeproms;
}

}  // namespace kilotwin
