/// Regions of the arena, and their places on paper.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>
#include <utility>

#include "clients/recorder/paths.hpp"
#include "core/plan/world.hpp"

namespace kilotwin::recorder {

/// Drawings inside a panel have integer coordinates in tenths of a pixel, which keeps them short.
inline constexpr double kUnitsPerPx = 10;
/// Size of explanations below a drawing.
inline constexpr double kCaption_px = 12;

struct Box {
  double x_min_mm = 1e300, y_min_mm = 1e300, x_max_mm = -1e300, y_max_mm = -1e300;
  void add(double x, double y) {
    x_min_mm = std::min(x_min_mm, x);
    x_max_mm = std::max(x_max_mm, x);
    y_min_mm = std::min(y_min_mm, y);
    y_max_mm = std::max(y_max_mm, y);
  }
  [[nodiscard]] Box widened(double by_mm) const {
    return {x_min_mm - by_mm, y_min_mm - by_mm, x_max_mm + by_mm, y_max_mm + by_mm};
  }
  [[nodiscard]] double width_mm() const { return x_max_mm - x_min_mm; }
  [[nodiscard]] double height_mm() const { return y_max_mm - y_min_mm; }
};

/// Maps a part of the arena to a panel of width x height px. y points up in the arena and down on paper.
class View {
 public:
  View(const Box& box, double width_px, double height_px)
      : width_px_(width_px),
        height_px_(height_px),
        px_per_mm_(std::min(width_px / box.width_mm(), height_px / box.height_mm())),
        x_mm_((box.x_min_mm + box.x_max_mm) / 2),
        y_mm_((box.y_min_mm + box.y_max_mm) / 2) {}
  [[nodiscard]] double px_per_mm() const { return px_per_mm_; }
  [[nodiscard]] long x(double x_mm) const {
    return std::lround(kUnitsPerPx * (width_px_ / 2 + (x_mm - x_mm_) * px_per_mm_));
  }
  [[nodiscard]] long y(double y_mm) const {
    return std::lround(kUnitsPerPx * (height_px_ / 2 - (y_mm - y_mm_) * px_per_mm_));
  }
  [[nodiscard]] double length(double mm) const { return kUnitsPerPx * mm * px_per_mm_; }
  [[nodiscard]] double width_px() const { return width_px_; }
  [[nodiscard]] double height_px() const { return height_px_; }

 private:
  double width_px_, height_px_, px_per_mm_, x_mm_, y_mm_;
};

template <class... Arguments>
void put(std::string& out, fmt::format_string<Arguments...> format, Arguments&&... arguments) {
  fmt::format_to(std::back_inserter(out), format, std::forward<Arguments>(arguments)...);
}

/// Diameter of a drawn robot, in units of the drawing: never less than 1.8 px.
[[nodiscard]] double disc_units(const View& view);
/// "30 s", "59.97 s", "1200 s": two decimals, without trailing zeros.
[[nodiscard]] std::string time_text(double time_s);
[[nodiscard]] bool failed(const Snapshot& at, std::size_t robot);
/// A bar of a round length, from (x, y) px on, with its length.
[[nodiscard]] std::string scale_bar(const View& view, double x, double y);

/// The box of all robots' centres.
[[nodiscard]] Box extent(const Snapshot& at);
/// Extends the box by whole movable bodies, in any orientation.
void add_movables(Box& box, const World& world, const Snapshot& at);
/// `box` widened to the aspect ratio of a panel, so that the panel shows exactly this box.
[[nodiscard]] Box fitted(const Box& box, double width_px, double height_px);
/// `box` moved into `outer`, which is at least as large.
[[nodiscard]] Box moved_into(const Box& box, const Box& outer);
/// `inner` with a margin if it is much smaller than `outer`, otherwise `outer`.
[[nodiscard]] Box zoomed(const Box& inner, const Box& outer);

}  // namespace kilotwin::recorder
