#include "clients/movie/frame_artist.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <utility>

#include "clients/recorder/discs.hpp"
#include "clients/recorder/svg.hpp"

namespace kilotwin::movie {
namespace {

using recorder::put;
namespace svg = recorder::svg;

constexpr double kMargin_px = 20, kTitle_px = 62, kFoot_px = 56, kText_px = 15;
constexpr std::size_t kMostPositions = 80;

double panel_width_px(const Look& look) { return look.width_px - 2 * kMargin_px; }
double panel_height_px(const Look& look) { return look.height_px - kTitle_px - kFoot_px; }

recorder::View view_of(const recorder::Ground& ground, const Look& look) {
  const recorder::Box arena = ground.arena();
  const recorder::Box shown = look.whole_arena ? arena : recorder::zoomed(ground.content(), arena);
  return {shown, panel_width_px(look), panel_height_px(look)};
}

}  // namespace

void Trails::add(const recorder::Snapshot& at) {
  if (trail_s_ <= 0) return;
  while (!positions_.empty() && positions_.front().time_s < at.time_s - trail_s_) positions_.pop_front();
  if (!positions_.empty() && at.time_s - positions_.back().time_s < trail_s_ / kMostPositions) return;
  Positions now{at.time_s, {}};
  for (std::size_t i = 0; i < at.x_mm.size(); ++i)
    now.points.push_back({static_cast<float>(at.x_mm[i]), static_cast<float>(at.y_mm[i])});
  positions_.push_back(std::move(now));
}

FrameArtist::FrameArtist(const recorder::RunOverview& run, Look look)
    : look_(std::move(look)),
      ground_(run),
      view_(view_of(ground_, look_)),
      name_(recorder::title_of(run)),
      facts_(recorder::facts_of(run, ground_.world())),
      cell_mm_(run.cell_mm),
      first_s_(run.paths.first().time_s),
      last_s_(run.paths.last().time_s) {}

std::string FrameArtist::draw_trails(const std::deque<Positions>& trails, const recorder::Snapshot& at) const {
  if (trails.empty()) return {};
  std::string lines;
  for (std::size_t i = 0; i < at.x_mm.size(); ++i) {
    if (!cell_mm_.empty() && cell_mm_[i] > 0) continue;
    long x = view_.x(trails.front().points[i].x_mm), y = view_.y(trails.front().points[i].y_mm);
    put(lines, "M{} {}", x, y);
    const auto to = [&](double x_mm, double y_mm) {
      const long next_x = view_.x(x_mm), next_y = view_.y(y_mm);
      if (next_x == x && next_y == y) return;
      x = next_x;
      y = next_y;
      put(lines, "L{} {}", x, y);
    };
    for (const Positions& earlier : trails) to(earlier.points[i].x_mm, earlier.points[i].y_mm);
    to(at.x_mm[i], at.y_mm[i]);
  }
  return fmt::format(
      "<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-opacity=\"0.35\" stroke-width=\"{:.1f}\" "
      "stroke-linecap=\"round\" stroke-linejoin=\"round\"/>\n",
      lines, svg::kPalette[0], std::clamp(recorder::disc_units(view_) * 0.2, 6.0, 40.0));
}

std::string FrameArtist::draw_time(double time_s, double baseline_px) const {
  const double right_px = look_.width_px - kMargin_px,
               share = last_s_ > first_s_ ? (time_s - first_s_) / (last_s_ - first_s_) : 1;
  std::string out = svg::text(right_px, baseline_px, kText_px, fmt::format("{:.1f} s", time_s), svg::kInk,
                              svg::Anchor::kEnd, true);
  out += svg::text(right_px - 90, baseline_px, recorder::kCaption_px,
                   fmt::format("{:g} times real time", look_.times_real), svg::kFaint, svg::Anchor::kEnd);
  const double line_px = look_.height_px - 10;
  put(out, "<path d=\"M{0} {1}h{2:.1f}\" stroke=\"{3}\" stroke-width=\"3\"/>\n", kMargin_px, line_px,
      panel_width_px(look_), svg::kLine);
  put(out, "<path d=\"M{0} {1}h{2:.1f}\" stroke=\"{3}\" stroke-width=\"3\"/>\n", kMargin_px, line_px,
      panel_width_px(look_) * std::clamp(share, 0.0, 1.0), svg::kPalette[0]);
  return out;
}

std::string FrameArtist::svg(const recorder::Snapshot& at, const recorder::Floors& floors,
                             const std::deque<Positions>& trails) const {
  const double width_px = panel_width_px(look_), height_px = panel_height_px(look_);
  std::string body = svg::text(kMargin_px, 28, 20, name_, svg::kInk, svg::Anchor::kStart, true);
  body += svg::text(kMargin_px, 49, 13, facts_, svg::kFaint);
  put(body,
      "<svg x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" viewBox=\"0 0 {:.0f} {:.0f}\" overflow=\"hidden\">\n",
      kMargin_px, kTitle_px, width_px, height_px, recorder::kUnitsPerPx * width_px,
      recorder::kUnitsPerPx * height_px);
  body += "<rect width=\"100%\" height=\"100%\" fill=\"#eef1f4\"/>\n";
  body += ground_.draw_floor(view_, floors) + ground_.draw_obstacles(view_) + ground_.draw_movables(view_, at);
  body += draw_trails(trails, at) + recorder::draw_robots(at, cell_mm_, view_) +
          ground_.draw_lamps(view_, at.time_s) + "</svg>\n";
  const double baseline_px = look_.height_px - 26;
  body += recorder::scale_bar(view_, kMargin_px + 1, baseline_px - 4);
  if (!look_.caption.empty())
    body += svg::text(look_.width_px / 2.0, baseline_px, kText_px, svg::shortened(look_.caption, 90), svg::kInk,
                      svg::Anchor::kMiddle);
  body += draw_time(at.time_s, baseline_px);
  return svg::document(look_.width_px, look_.height_px, name_, facts_, body);
}

}  // namespace kilotwin::movie
