#include "core/experiment/poses_csv.hpp"

#include <fmt/format.h>

#include <string>

#include "core/base/pose.hpp"
#include "core/base/say.hpp"
#include "core/csv/csv_reader.hpp"
#include "core/experiment/limits.hpp"
#include "core/experiment/text_file.hpp"
#include "core/math/elementary.h"

namespace kilotwin {
namespace {

constexpr std::string_view kRadians = "x_mm,y_mm,heading_rad", kDegrees = "x_mm,y_mm,heading_deg";

}  // namespace

CsvPoses read_poses_csv(const std::filesystem::path& file, std::string_view named_at) {
  CsvReader csv(one_line(file.string()), read_text(file, named_at));
  const bool degrees = csv.find_column("heading_deg").has_value();
  csv.require({"x_mm", "y_mm", degrees ? "heading_deg" : "heading_rad"},
              fmt::format("{} or {}", kRadians, kDegrees));
  const std::size_t x = csv.column("x_mm"), y = csv.column("y_mm"),
                    heading = csv.column(degrees ? "heading_deg" : "heading_rad");
  CsvPoses poses;
  while (csv.next()) {
    if (poses.line.size() == kMostRobots)
      csv.complain(0, fmt::format("the file has more than {} rows; an experiment takes at most that many robots",
                                  kMostRobots));
    const double value = csv.number(heading);
    const double heading_rad = degrees ? kt_fmod(value, 360) * (kPi / 180) : kt_fmod(value, 2 * kPi);
    poses.x_mm.push_back(csv.number(x));
    poses.y_mm.push_back(csv.number(y));
    poses.heading_rad.push_back(wrapped(heading_rad));
    poses.line.push_back(static_cast<std::uint32_t>(csv.line()));
  }
  if (poses.line.empty()) {
    throw UserError{fmt::format("{}:2:1: there are no poses; the file takes the header {} and a row per robot",
                                one_line(file.string()), kRadians)};
  }
  return poses;
}

}  // namespace kilotwin
