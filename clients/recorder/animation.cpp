#include "clients/recorder/animation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <vector>

#include "clients/recorder/discs.hpp"
#include "clients/recorder/ground.hpp"
#include "clients/recorder/svg.hpp"
#include "clients/recorder/view.hpp"
#include "core/base/pose.hpp"

namespace kilotwin::recorder {
namespace {

constexpr double kMargin_px = 28, kTitle_px = 56, kFoot_px = 64, kWidth_px = 720, kMostHeight_px = 640;
constexpr std::string_view kMarker = "#2563a8";

/// Pauses and continues by click and space bar; starts paused where the system asks for reduced motion.
constexpr std::string_view kScript = R"(<script>
const root = document.documentElement;
const toggle = () => root.animationsPaused() ? root.unpauseAnimations() : root.pauseAnimations();
addEventListener('click', toggle);
addEventListener('keydown', event => { if (event.key === ' ') { event.preventDefault(); toggle(); } });
if (matchMedia('(prefers-reduced-motion: reduce)').matches) root.pauseAnimations();
</script>
)";

/// A pose of a drawn body: tenths of a pixel, degrees clockwise on paper.
struct Frame {
  long x, y, degrees;
};

/// Headings become continuous, so that a robot turns the short way between frames.
void unwrap(std::vector<Frame>& frames) {
  for (std::size_t k = 1; k < frames.size(); ++k) {
    const long turn = (frames[k].degrees - frames[k - 1].degrees) % 360;
    frames[k].degrees = frames[k - 1].degrees + (turn > 180 ? turn - 360 : turn < -180 ? turn + 360 : turn);
  }
}

class Player {
 public:
  Player(std::size_t frames, double duration_s)
      : frames_(frames), timing_(fmt::format("dur=\"{:g}s\" repeatCount=\"indefinite\"", duration_s)) {}

  /// Attributes that move a group along the frames, and the group's content.
  [[nodiscard]] std::string moving(std::vector<Frame> frames, std::string_view attributes,
                                   std::string_view content) const {
    unwrap(frames);
    const Frame& first = frames[0];
    std::string out = fmt::format("<g {} transform=\"translate({} {})\">", attributes, first.x, first.y);
    if (differ(frames, [](const Frame& f) { return std::pair(f.x, f.y); }))
      out += transform("translate", frames, [](const Frame& f) { return fmt::format("{} {}", f.x, f.y); });
    out += fmt::format("<g transform=\"rotate({})\">", first.degrees);
    if (differ(frames, [](const Frame& f) { return f.degrees; }))
      out += transform("rotate", frames, [](const Frame& f) { return fmt::format("{}", f.degrees); });
    return fmt::format("{}{}</g></g>\n", out, content);
  }

  /// Changes of an attribute of the group that contains it, frame by frame; empty if there are none.
  [[nodiscard]] std::string changing(std::string_view attribute, const std::vector<std::string>& values) const {
    std::string shown, times;
    for (std::size_t k = 0; k < values.size(); ++k) {
      if (k > 0 && values[k] == values[k - 1]) continue;
      put(shown, "{}{}", k > 0 ? ";" : "", values[k]);
      // At a frame's time the state is that of the frame.
      put(times, "{}{:.4g}", k > 0 ? ";" : "", static_cast<double>(k) / static_cast<double>(frames_ - 1));
    }
    if (shown == values[0]) return {};
    return fmt::format("<animate attributeName=\"{}\" calcMode=\"discrete\" values=\"{}\" keyTimes=\"{}\" {}/>",
                       attribute, shown, times, timing_);
  }

  [[nodiscard]] const std::string& timing() const { return timing_; }

 private:
  template <class Key> [[nodiscard]] static bool differ(const std::vector<Frame>& frames, Key key) {
    return std::any_of(frames.begin(), frames.end(), [&](const Frame& f) { return key(f) != key(frames[0]); });
  }
  template <class Text>
  [[nodiscard]] std::string transform(std::string_view type, const std::vector<Frame>& frames, Text text) const {
    std::string values;
    for (const Frame& frame : frames) values += (values.empty() ? "" : ";") + text(frame);
    return fmt::format("<animateTransform attributeName=\"transform\" type=\"{}\" values=\"{}\" {}/>", type, values,
                       timing_);
  }

  std::size_t frames_;
  std::string timing_;
};

Frame frame_of(const View& view, double x_mm, double y_mm, double heading_rad) {
  return {view.x(x_mm), view.y(y_mm), -std::lround(heading_rad * 180 / kPi)};
}

/// The disc of every robot, around the origin, its front to the right. Its colour is the group's.
std::string robot_symbol(const View& view) {
  const double disc = disc_units(view), rim = std::clamp(disc * 0.09, 1.5, 18.0);
  return fmt::format(
      "<defs><g id=\"r\"><circle r=\"{:.1f}\" stroke-width=\"{:.1f}\"/><path d=\"M0 0H{:.1f}\" stroke=\"{}\" "
      "stroke-width=\"{:.1f}\"/></g></defs>\n",
      (disc - rim) / 2, rim, disc / 2, svg::kInk, std::clamp(disc * 0.1, 1.5, 24.0));
}

/// The square of a cell of a Kilogrid, in the colour of its LED.
std::string draw_cell(const std::vector<Snapshot>& film, std::size_t cell, double side_mm, const View& view,
                      const Player& player) {
  std::vector<std::string> fills, opacities;
  for (const Snapshot& at : film) {
    const std::uint8_t led = at.led[cell] & 63;
    fills.push_back(svg::led_colour(led));
    opacities.emplace_back(led == 0 ? "0.15" : "0.5");
  }
  const double side = view.length(kCellPart * side_mm);
  return fmt::format(
      "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"{}\" "
      "fill-opacity=\"{}\">{}{}</rect>\n",
      static_cast<double>(view.x(film[0].x_mm[cell])) - side / 2,
      static_cast<double>(view.y(film[0].y_mm[cell])) - side / 2, side, side, fills[0], opacities[0],
      player.changing("fill", fills), player.changing("fill-opacity", opacities));
}

std::string animate_robots(const RunOverview& run, const View& view, const Player& player) {
  const std::vector<Snapshot>& film = run.film.frames();
  std::string out;
  for (std::size_t i = 0; i < run.cell_mm.size(); ++i) {
    if (run.cell_mm[i] > 0) out += draw_cell(film, i, run.cell_mm[i], view, player);
  }
  out += robot_symbol(view);
  for (std::size_t i = 0; i < film[0].x_mm.size(); ++i) {
    if (!run.cell_mm.empty() && run.cell_mm[i] > 0) continue;
    std::vector<Frame> frames;
    std::vector<std::string> fills, rims;
    for (const Snapshot& at : film) {
      frames.push_back(frame_of(view, at.x_mm[i], at.y_mm[i], at.heading_rad[i]));
      fills.push_back(svg::led_colour(at.led[i] & 63));
      rims.emplace_back(failed(at, i) ? kFailedRim : svg::kInk);
    }
    const std::string style = fmt::format("fill=\"{}\" stroke=\"{}\"", fills[0], rims[0]);
    out += player.moving(std::move(frames), style,
                         player.changing("fill", fills) + player.changing("stroke", rims) + "<use href=\"#r\"/>");
  }
  return out;
}

std::string draw_movables(const std::vector<Snapshot>& film, const Ground& ground, const View& view,
                          const Player& player) {
  std::string out;
  const Place origin = Place::at(0, 0, 0);
  for (std::size_t body = 0; body < ground.world().movables.size(); ++body) {
    std::vector<Frame> frames;
    frames.reserve(film.size());
    for (const Snapshot& at : film)
      frames.push_back(frame_of(view, at.movable_x_mm[body], at.movable_y_mm[body], at.movable_heading_rad[body]));
    out += player.moving(std::move(frames), "",
                         fmt::format("<g transform=\"translate({} {})\">{}</g>", -view.x(0), -view.y(0),
                                     ground.draw_movable(body, view, origin)));
  }
  return out;
}

/// A line from start to end with a mark that moves along it.
std::string time_line(double x, double y, double width, const std::vector<Snapshot>& film, const Player& player) {
  std::string out =
      fmt::format("<path d=\"M{0} {1}h{2}\" stroke=\"{3}\" stroke-width=\"3\"/>\n", x, y, width, svg::kLine);
  put(out,
      "<circle cx=\"{0}\" cy=\"{1}\" r=\"5\" fill=\"{2}\"><animate attributeName=\"cx\" values=\"{0};{3}\" {4}/>",
      x, y, kMarker, x + width, player.timing());
  out += "</circle>\n" + svg::text(x, y + 22, kCaption_px, time_text(film.front().time_s), svg::kFaint);
  return out +
         svg::text(x + width, y + 22, kCaption_px, time_text(film.back().time_s), svg::kFaint, svg::Anchor::kEnd);
}

}  // namespace

std::string animation_svg(const RunOverview& run) {
  const std::vector<Snapshot>& film = run.film.frames();
  if (film.size() < 2) return {};
  const Ground ground(run);
  const Box shown = zoomed(ground.content(), ground.arena());
  const double height_px = std::clamp(kWidth_px * shown.height_mm() / shown.width_mm(), 160.0, kMostHeight_px);
  const View view(shown, kWidth_px, height_px);
  const double simulated_s = film.back().time_s - film.front().time_s;
  const double duration_s = std::clamp(simulated_s / 5, 6.0, 24.0);
  const Player player(film.size(), duration_s);

  const std::string name = title_of(run), facts = facts_of(run, ground.world());
  const double top = kMargin_px + kTitle_px, below = top + height_px;
  std::string body = svg::text(kMargin_px, kMargin_px + 16, 22, name, svg::kInk, svg::Anchor::kStart, true);
  body += svg::text(kMargin_px, kMargin_px + 38, 14, facts, svg::kFaint);
  put(body,
      "<svg x=\"{}\" y=\"{}\" width=\"{}\" height=\"{:.1f}\" viewBox=\"0 0 {} {:.0f}\" overflow=\"hidden\">\n",
      kMargin_px, top, kWidth_px, height_px, kUnitsPerPx * kWidth_px, kUnitsPerPx * height_px);
  body += "<rect width=\"100%\" height=\"100%\" fill=\"#eef1f4\"/>\n";
  body += ground.draw_floor(view, run.first_floors) + ground.draw_obstacles(view);
  body += draw_movables(film, ground, view, player) + animate_robots(run, view, player);
  body += ground.draw_lamps(view, film.front().time_s) + "</svg>\n";
  put(body, "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{:.1f}\" fill=\"none\" stroke=\"{}\"/>\n", kMargin_px,
      top, kWidth_px, height_px, svg::kLine);
  body += scale_bar(view, kMargin_px + 1, below + 14);
  body += svg::text(kMargin_px + kWidth_px, below + 18, kCaption_px,
                    fmt::format("{:g} times real time; click or space bar: pause",
                                std::round(10 * simulated_s / duration_s) / 10),
                    svg::kFaint, svg::Anchor::kEnd);
  body += time_line(kMargin_px, below + 36, kWidth_px, film, player);
  body += kScript;
  return svg::document(kWidth_px + 2 * kMargin_px, below + kFoot_px + 8, name,
                       facts + ". All robots in motion, in a loop.", body);
}

}  // namespace kilotwin::recorder
