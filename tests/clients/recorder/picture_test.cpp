#include "clients/recorder/picture.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <sstream>
#include <vector>

#include "clients/recorder/axis.hpp"
#include "clients/recorder/paths.hpp"
#include "clients/recorder/svg.hpp"
#include "core/base/error.hpp"
#include "tests/clients/recorder/synthetic.hpp"
#include "tests/clients/recorder/xml.hpp"

namespace kilotwin::recorder {
namespace {

std::string picture_of(const Scratch& scratch, const proto::RecordingHeader& header, std::int64_t ticks) {
  std::filesystem::remove(scratch / "r.ktrec");
  write_synthetic(scratch / "r.ktrec", header, ticks);
  Reader reader(scratch / "r.ktrec");
  return picture_svg(read_overview(reader));
}

std::size_t discs(const Xml& xml, const std::string& colour) {
  std::size_t count = 0;
  for (const Element& element : xml.elements()) {
    if (element.name != "path" || element.attribute("stroke") != colour) continue;
    const std::string d = element.attribute("d");
    count += static_cast<std::size_t>(std::count(d.begin(), d.end(), 'M'));
  }
  return count;
}

TEST(Picture, ShowsTitleTimesLegendAndScale) {
  const Scratch scratch;
  const Xml xml(picture_of(scratch, synthetic_header(40), 300));
  ASSERT_FALSE(xml.elements().empty());
  EXPECT_EQ(xml.elements()[0].name, "svg");
  for (const char* const text :
       {"synthetic", "40 robots", "seed 42", "9.83 s simulated", "Start", "Paths", "End", "failed 1", " mm"}) {
    EXPECT_TRUE(xml.has_text(text)) << text;
  }
  // Robot 1 has a dim red LED: once in the start panel, once in the end panel. Each panel also has one failed robot.
  EXPECT_EQ(discs(xml, svg::led_colour(1)), 2u);
  EXPECT_EQ(discs(xml, "#d0021b"), 2u);
  // A background of its own, for light and dark pages.
  const auto ground =
      std::find_if(xml.elements().begin(), xml.elements().end(), [](const Element& e) { return e.name == "rect"; });
  EXPECT_EQ(ground->attribute("fill"), "#ffffff");
}

TEST(Picture, CellsAreSquaresAndCountApart) {
  const Scratch scratch;
  proto::RecordingHeader header = synthetic_header(8);
  for (const std::uint32_t count : {5u, 3u}) header.add_group_robots(count);
  for (const double side : {0.0, 50.0}) header.add_group_cell_mm(side);
  const Xml xml(picture_of(scratch, header, 300));
  EXPECT_TRUE(xml.has_text("5 robots"));
  EXPECT_TRUE(xml.has_text("3 cells"));
  // Robots 0 to 4 are discs of the LED's colour i; the cells 5 to 7 are squares, with one path per colour and panel.
  EXPECT_EQ(discs(xml, svg::led_colour(4)), 2u);
  EXPECT_EQ(discs(xml, svg::led_colour(5)), 0u);
  const auto squares = std::count_if(xml.elements().begin(), xml.elements().end(),
                                     [](const Element& e) { return e.attribute("class") == "cells"; });
  EXPECT_EQ(squares, 2 * 3);
  EXPECT_FALSE(xml.has_text("failed 1")) << "the last cell, not a robot";

  header.add_group_cell_mm(50);
  EXPECT_THROW((void)picture_of(scratch, header, 30), UserError) << "sides of more groups than there are";
}

TEST(Picture, ShowsLampsWhereTheyAre) {
  const Scratch scratch;
  proto::RecordingHeader header = synthetic_header(4);
  proto::LightSource& lamp = *header.mutable_light()->add_source();
  lamp.add_switch_s(0.001);
  lamp.mutable_circle();
  const Xml xml(picture_of(scratch, header, 300));
  int shining = 0, off = 0;
  for (const Element& element : xml.elements()) {
    if (element.name != "circle" || element.attribute("stroke") != "#f5a623") continue;
    ++(element.attribute("fill") == "none" ? off : shining);
  }
  EXPECT_EQ(shining, 1) << "at the start";
  EXPECT_EQ(off, 1) << "at the end";
}

TEST(Picture, EnlargesASmallSwarmAndSaysSo) {
  const Scratch scratch;
  proto::RecordingHeader header = synthetic_header(3);
  const Xml near(picture_of(scratch, header, 1000));
  EXPECT_TRUE(near.has_text("enlarged"));
  EXPECT_TRUE(near.has_text("dashed frame"));
  header.set_arena_width_mm(60);
  header.set_arena_height_mm(60);
  const Xml full(picture_of(scratch, header, 1));
  EXPECT_FALSE(full.has_text("enlarged"));
}

TEST(Picture, ShowsFoodAndHomeOfTheStation) {
  const Scratch scratch;
  proto::RecordingHeader header = synthetic_header(4);
  header.set_arena_height_mm(2000);
  header.add_environment()->mutable_foraging();
  header.add_environment()->mutable_hub();
  const Xml xml(picture_of(scratch, header, 30));
  for (const char* const name : {"food", "home", "hub"}) {
    EXPECT_TRUE(xml.has_text(name)) << name;
  }
  // The food's circle, far from all robots, lies within the panels of paths and of the end. The start panel is enlarged.
  int circles = 0, within = 0;
  for (const Element& element : xml.elements()) {
    if (element.name != "circle" || element.attribute("stroke") != "#b8860b") continue;
    ++circles;
    if (std::stod(element.attribute("cx")) >= 0 && std::stod(element.attribute("cy")) >= 0) ++within;
  }
  EXPECT_EQ(circles, 3);
  EXPECT_GE(within, 2);
}

/// The coordinates in a path or a rectangle.
std::vector<double> numbers_of(std::string text) {
  for (char& c : text) c = (c >= '0' && c <= '9') || c == '-' || c == '.' ? c : ' ';
  std::istringstream in(text);
  return {std::istream_iterator<double>(in), {}};
}

TEST(Picture, ShowsMovableBodiesWholeWhereItEnlarges) {
  const Scratch scratch;
  proto::RecordingHeader header = synthetic_header(3);
  proto::MovableBody& body = *header.add_movable();
  body.mutable_box()->set_width_mm(300);
  body.mutable_box()->set_length_mm(100);
  {
    Writer writer(scratch / "r.ktrec", header);
    for (const int t : {0, 1}) {
      const std::vector<double> x{-40, 0, 40}, y(3, -400 + 300.0 * t), heading(3, 1.57), body_x{0},
          body_y{-330 + 300.0 * t}, body_heading{0};
      const std::vector<std::uint8_t> led(3, 0), life(3, 4);
      writer.state({Tick{t}, x, y, heading, led, life, body_x, body_y, body_heading});
    }
    writer.end(Tick{1}, 0);
  }
  Reader reader(scratch / "r.ktrec");
  const Xml xml(picture_svg(read_overview(reader)));
  EXPECT_TRUE(xml.has_text("see dashed frame"));
  std::vector<double> panel;  // viewBox of the current panel
  int bodies = 0, frames = 0;
  for (const Element& element : xml.elements()) {
    if (element.name == "svg") panel = numbers_of(element.attribute("viewBox"));
    if (element.name == "path" && element.attribute("fill") == "#e9d8b4") {
      ++bodies;
      const std::vector<double> corners = numbers_of(element.attribute("d"));
      ASSERT_EQ(corners.size(), 8u);
      for (std::size_t i = 0; i < corners.size(); ++i) {
        EXPECT_GT(corners[i], 0) << "body " << bodies;
        EXPECT_LT(corners[i], panel[2 + i % 2]) << "body " << bodies;
      }
    }
    if (element.name == "rect" && element.attribute("stroke-dasharray") == "60 40") {
      ++frames;
      const double left = std::stod(element.attribute("x")), top = std::stod(element.attribute("y"));
      EXPECT_GE(left, -1);
      EXPECT_GE(top, -1);
      EXPECT_LE(left + std::stod(element.attribute("width")), panel[2] + 1);
      EXPECT_LE(top + std::stod(element.attribute("height")), panel[3] + 1);
      EXPECT_NEAR(std::stod(element.attribute("width")) / std::stod(element.attribute("height")),
                  panel[2] / panel[3], 0.02)
          << "the frame has the shape of the panel that it stands for";
    }
  }
  EXPECT_EQ(bodies, 3);
  EXPECT_EQ(frames, 1);
}

TEST(Picture, DegenerateRunsAreDrawn) {
  const Scratch scratch;
  proto::RecordingHeader header = synthetic_header(1);
  header.set_name("<a & \"b\">\x01\xff \xc3\xa9");
  const Xml one(picture_of(scratch, header, 0));
  ASSERT_FALSE(one.elements().empty());
  EXPECT_TRUE(one.has_text("<a & \"b\">?? \u00e9"));
  for (const auto& [width, height] : {std::pair{1e6, 40.0}, {40.0, 1e6}, {20000.0, 20000.0}, {3000.0, 500.0}}) {
    header.set_arena_width_mm(width);
    header.set_arena_height_mm(height);
    EXPECT_FALSE(Xml(picture_of(scratch, header, 5000)).elements().empty());
  }
}

TEST(ScaleBar, StepsAreRound) {
  EXPECT_DOUBLE_EQ(round_step(10, 5), 2);
  EXPECT_DOUBLE_EQ(round_step(10, 10), 1);
  EXPECT_DOUBLE_EQ(round_step(11, 5), 5);
  EXPECT_DOUBLE_EQ(round_step(0.7, 7), 0.1);
  EXPECT_DOUBLE_EQ(round_step(6e6, 6), 1e6);
}

TEST(Picture, NeedsAState) {
  const Scratch scratch;
  Writer(scratch / "r.ktrec", synthetic_header(1)).end(Tick{0}, 0);
  Reader reader(scratch / "r.ktrec");
  EXPECT_THROW((void)picture_svg(read_overview(reader)), UserError);
}

TEST(Picture, TenThousandRobotsStayBelowThreeMegabytes) {
  const Scratch scratch;
  constexpr std::uint32_t kRobots = 10'000;
  proto::RecordingHeader header = synthetic_header(kRobots);
  header.set_arena_width_mm(5000);
  header.set_arena_height_mm(5000);
  {
    // Paths with many bends: straight ones would have short texts.
    Writer writer(scratch / "r.ktrec", header);
    SyntheticState state(kRobots, Tick{0});
    for (std::int64_t t = 0; t < 100; ++t) {
      for (std::uint32_t i = 0; i < kRobots; ++i) {
        const auto mixed = (static_cast<std::uint64_t>(t) * kRobots + i) * 0x9e3779b97f4a7c15u >> 32;
        state.x_mm[i] = (i % 100) * 40.0 - 2000 + static_cast<double>(mixed % 600) - 300;
        state.y_mm[i] = (i / 100) * 40.0 - 2000 + static_cast<double>(mixed / 600 % 600) - 300;
      }
      writer.state(state.view(Tick{t}));
    }
    writer.end(Tick{99}, 0);
  }
  Reader reader(scratch / "r.ktrec");
  const std::string svg = picture_svg(read_overview(reader));
  EXPECT_LT(svg.size(), 3'000'000u);
  EXPECT_FALSE(Xml(svg).elements().empty());
}

TEST(Paths, KeepFirstLastAndEvenlySpacedStates) {
  const Scratch scratch;
  {
    Writer writer(scratch / "r.ktrec", synthetic_header(2));
    for (std::int64_t t = 0; t < 1000; ++t) writer.state(SyntheticState(2, Tick{t}).view(Tick{t}));
    writer.end(Tick{999}, 0);
  }
  Reader reader(scratch / "r.ktrec");
  Paths paths(2, 100);
  while (const proto::StateRecord* const state = reader.next_state()) paths.add(*state, reader.tick_length());
  EXPECT_EQ(paths.states(), 1000u);
  EXPECT_EQ(paths.first().time_s, 0);
  EXPECT_DOUBLE_EQ(paths.last().time_s, 999 * 0.032768);
  const std::vector<Point> path = paths.path(1);
  EXPECT_GE(path.size(), 25u);
  EXPECT_LE(path.size(), 51u);
  EXPECT_EQ(path.front().x_mm, 10);
  EXPECT_EQ(path.back().x_mm, 10 + 0.5f * 999);
  const float step = path[1].x_mm - path[0].x_mm;
  for (std::size_t i = 1; i + 1 < path.size(); ++i) EXPECT_EQ(path[i].x_mm - path[i - 1].x_mm, step);
}

TEST(Paths, SimplifiedStayWithinTheTolerance) {
  std::vector<Point> path;
  for (int i = 0; i <= 100; ++i)
    path.push_back(
        {static_cast<float>(i), i <= 50 ? 0.05f * static_cast<float>(i % 2) : static_cast<float>(i - 50)});
  const std::vector<Point> simple = simplified(path, 0.2);
  ASSERT_EQ(simple.size(), 3u);
  EXPECT_EQ(simple[0].x_mm, 0);
  EXPECT_NEAR(simple[1].x_mm, 50, 1);
  EXPECT_EQ(simple[2].x_mm, 100);
  EXPECT_EQ(simplified(std::vector<Point>{{1, 2}}, 1).size(), 1u);
}

TEST(Svg, LedNames) {
  EXPECT_EQ(svg::led_name(0), "off");
  EXPECT_EQ(svg::led_name(3), "red");
  EXPECT_EQ(svg::led_name(1 << 2), "dim green");
  EXPECT_EQ(svg::led_name(63), "white");
  EXPECT_EQ(svg::led_name(1 | 3 << 2), "rgb 130");
}

}  // namespace
}  // namespace kilotwin::recorder
