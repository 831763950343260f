#include "clients/recorder/animation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <sstream>
#include <string>
#include <vector>

#include "clients/recorder/evenly_spaced.hpp"
#include "clients/recorder/overview.hpp"
#include "clients/recorder/svg.hpp"
#include "tests/clients/recorder/synthetic.hpp"
#include "tests/clients/recorder/xml.hpp"

namespace kilotwin::recorder {
namespace {

/// A robot's states, one per tick of a recording of one robot.
struct Pose {
  double x_mm, y_mm, heading_rad;
  std::uint8_t led;
};

std::string animation_of(const std::vector<Pose>& poses) {
  const Scratch scratch;
  proto::RecordingHeader header = synthetic_header(1);
  {
    Writer writer(scratch / "r.ktrec", header);
    std::int64_t tick = 0;
    for (const Pose& pose : poses) {
      const std::vector<double> x{pose.x_mm}, y{pose.y_mm}, heading{pose.heading_rad};
      const std::vector<std::uint8_t> led{pose.led}, life{4};
      writer.state({Tick{tick++}, x, y, heading, led, life, {}, {}, {}});
    }
    writer.end(Tick{tick - 1}, 0);
  }
  Reader reader(scratch / "r.ktrec");
  return animation_svg(read_overview(reader));
}

std::vector<std::string> parts(const std::string& text, char separator) {
  std::vector<std::string> out;
  std::istringstream in(text);
  for (std::string part; std::getline(in, part, separator);) out.push_back(part);
  return out;
}

/// The values of the first animation of this kind.
std::vector<std::string> values_of(const Xml& xml, const char* element, const char* key, const char* value) {
  for (const Element& e : xml.elements()) {
    if (e.name == element && e.attribute(key) == value) return parts(e.attribute("values"), ';');
  }
  return {};
}

TEST(Animation, MovesARobotThroughItsStates) {
  const Xml xml(animation_of({{0, 0, 0, 0}, {10, 0, 0, 0}, {10, 20, 0, 0}}));
  const std::vector<std::string> places = values_of(xml, "animateTransform", "type", "translate");
  ASSERT_EQ(places.size(), 3u);
  std::vector<double> x, y;
  for (const std::string& place : places) {
    const std::vector<std::string> coordinates = parts(place, ' ');
    x.push_back(std::stod(coordinates.at(0)));
    y.push_back(std::stod(coordinates.at(1)));
  }
  EXPECT_GT(x[1], x[0]);
  EXPECT_EQ(y[1], y[0]);
  EXPECT_EQ(x[2], x[1]);
  EXPECT_NEAR(y[1] - y[2], 2 * (x[1] - x[0]), 2) << "y points up in the arena, down on paper";
}

TEST(Animation, TurnsTheShortWay) {
  // From 170 to -170 degrees: 20 degrees anticlockwise.
  const Xml xml(animation_of({{0, 0, 170 * kPi / 180, 0}, {0, 0, -170 * kPi / 180, 0}}));
  const std::vector<std::string> angles = values_of(xml, "animateTransform", "type", "rotate");
  ASSERT_EQ(angles.size(), 2u);
  EXPECT_EQ(std::stol(angles[1]) - std::stol(angles[0]), -20) << "clockwise on paper is negative in the arena";
}

TEST(Animation, LedChangesWhenTheStateDoes) {
  const Xml xml(animation_of({{0, 0, 0, 3}, {0, 0, 0, 3}, {0, 0, 0, 12}, {0, 0, 0, 12}, {0, 0, 0, 12}}));
  EXPECT_EQ(values_of(xml, "animate", "attributeName", "fill"),
            (std::vector<std::string>{std::string(svg::led_colour(3)), std::string(svg::led_colour(12))}));
  for (const Element& e : xml.elements()) {
    if (e.name == "animate" && e.attribute("attributeName") == "fill") {
      EXPECT_EQ(e.attribute("keyTimes"), "0;0.5");
    }
  }
  EXPECT_TRUE(values_of(xml, "animateTransform", "type", "translate").empty())
      << "a robot at rest needs no animation";
}

TEST(Animation, IsEmptyForASingleStateAndForLargeSwarms) {
  EXPECT_EQ(animation_of({{0, 0, 0, 0}}), "");
  const Scratch scratch;
  write_synthetic(scratch / "r.ktrec", synthetic_header(Film::kMostRobots + 1), 3);
  Reader reader(scratch / "r.ktrec");
  EXPECT_EQ(animation_svg(read_overview(reader)), "");
}

TEST(Animation, OfManyStatesStaysSmall) {
  const Scratch scratch;
  write_synthetic(scratch / "r.ktrec", synthetic_header(100), 5000);
  Reader reader(scratch / "r.ktrec");
  const RunOverview run = read_overview(reader);
  EXPECT_GE(run.film.frames().size(), 120u);
  EXPECT_LE(run.film.frames().size(), 240u);
  const std::string svg = animation_svg(run);
  EXPECT_LT(svg.size(), 600'000u);
  EXPECT_FALSE(Xml(svg).elements().empty());
}

TEST(EvenlySpaced, KeepsTheFirstAndEqualSteps) {
  for (std::size_t length = 1; length < 200; ++length) {
    EvenlySpaced<std::size_t> kept(8);
    for (std::size_t i = 0; i < length; ++i) {
      if (kept.wants_next()) kept.keep(i);
    }
    ASSERT_LE(kept.values().size(), 8u);
    ASSERT_GE(kept.values().size(), std::min<std::size_t>(length, 4));
    ASSERT_EQ(kept.values()[0], 0u);
    for (std::size_t k = 1; k < kept.values().size(); ++k)
      ASSERT_EQ(kept.values()[k], k * (kept.values().size() > 1 ? kept.values()[1] : 1)) << length;
  }
}

}  // namespace
}  // namespace kilotwin::recorder
