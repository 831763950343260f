#include "tests/identify/fuzz/odd_set.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>

#include "tests/identify/truth/dice.hpp"

namespace kilotwin::truth {
namespace {

constexpr std::array kMotions = {"stop", "straight", "left", "right"};

struct Row {
  std::string run;
  std::uint32_t robot;
  double time_s, x_mm, y_mm, heading_rad;
};

/// Properties that all robots of a set share.
struct Layout {
  int robots, runs;
  double duration_s, sample_s, jitter, room_mm, noise_mm;
  double apart_mm;  ///< between the rooms of two runs
  double tired;     ///< share of the speed that is lost within 60 s
  bool slow_half;   ///< half of the robots drive at half speed where x > 0
  bool commands, commands_rest;
};

Layout layout_of(Dice& dice) {
  constexpr std::array kSamples_s = {0.05, 0.2, 0.5, 1.0, 2.5, 5.0, 20.0};
  Layout l{};
  const bool many = dice.uniform() < 0.1;
  l.robots = many ? 30 : 1 + dice.pick(6);
  l.runs = 1 + dice.pick(3);
  l.duration_s = dice.between(5, 90);
  l.sample_s = kSamples_s[static_cast<std::size_t>(dice.pick(kSamples_s.size()))];
  // A raster of many samples needs time, and shows nothing that fewer do not.
  if (l.sample_s < 0.1) l.duration_s = std::min(l.duration_s, 20.0);
  if (many) l.duration_s = std::min(l.duration_s, 40.0);
  l.apart_mm = dice.uniform() < 0.1 ? dice.between(1e4, 4e5) : 0;
  l.tired = dice.uniform() < 0.3 ? dice.between(0.1, 0.9) : 0;
  l.slow_half = dice.uniform() < 0.2;
  l.jitter = dice.uniform() < 0.5 ? 0 : dice.between(0, 0.9);
  l.room_mm = dice.uniform() < 0.3 ? 100 : dice.between(100, 3000);
  l.noise_mm = dice.uniform() < 0.2 ? 0 : dice.between(0.1, 2);
  l.commands = dice.uniform() < 0.7;
  l.commands_rest = dice.uniform() < 0.1;
  return l;
}

/// Drives one robot of one run, and appends its rows and commands.
void drive(const Layout& l, Dice& dice, const std::string& run, double from_x_mm, std::uint32_t robot,
           std::vector<Row>& rows, std::string& commands) {
  double x = dice.between(-0.5, 0.5) * l.room_mm, y = dice.between(-0.5, 0.5) * l.room_mm,
         heading = dice.between(-M_PI, M_PI), next_sample_s = 0, next_command_s = 0;
  int motion = 1;
  constexpr double kStep_s = 0.05;
  for (double t = 0; t <= l.duration_s; t += kStep_s) {
    if (l.commands && t >= next_command_s) {
      motion = l.commands_rest ? 0 : dice.pick(4);
      commands += fmt::format("{},{},{:.3f},{}\n", run, robot, t, kMotions[static_cast<std::size_t>(motion)]);
      next_command_s = t + dice.between(0.5, 12);
    }
    if (t >= next_sample_s) {
      rows.push_back({run, robot, t, from_x_mm + x + l.noise_mm * dice.normal(), y + l.noise_mm * dice.normal(),
                      heading + 0.03 * dice.normal()});
      next_sample_s += l.sample_s * (1 + l.jitter * dice.between(-0.5, 0.5));
    }
    const double speed = (1 - l.tired * std::min(1.0, t / 60)) * (l.slow_half && robot % 2 == 1 && x > 0 ? 0.5 : 1);
    const double left = speed * (motion == 1   ? 10
                                 : motion == 3 ? 20
                                               : 0),
                 right = speed * (motion == 1   ? 10
                                  : motion == 2 ? 20
                                                : 0);
    x = std::clamp(x + kStep_s * (left + right) / 2 * std::cos(heading), -0.5 * l.room_mm, 0.5 * l.room_mm);
    y = std::clamp(y + kStep_s * (left + right) / 2 * std::sin(heading), -0.5 * l.room_mm, 0.5 * l.room_mm);
    heading += kStep_s * (right - left) / 25;
  }
}

/// One oddity of the rows. Returns it in words.
std::string spoil(std::vector<Row>& rows, Dice& dice) {
  if (rows.empty()) return "no rows";
  const auto any = [&]() -> Row& {
    return rows[static_cast<std::size_t>(dice.pick(static_cast<int>(rows.size())))];
  };
  const Row chosen = any();
  const auto of_chosen = [&](const Row& r) { return r.robot == chosen.robot && r.run == chosen.run; };
  switch (dice.pick(18)) {
    case 0: std::erase_if(rows, [&](const Row&) { return dice.uniform() < 0.6; }); return "missing samples";
    case 1:
      std::erase_if(rows, [&](const Row& r) { return std::abs(r.time_s - chosen.time_s) < 15; });
      return "a gap of 30 s";
    case 2:
      for (Row& r : rows)
        if (of_chosen(r)) r.x_mm = chosen.x_mm, r.y_mm = chosen.y_mm;
      return "a robot at one place";
    case 3:
      for (Row& r : rows) r.x_mm = chosen.x_mm, r.y_mm = chosen.y_mm;
      return "all robots at one place";
    case 4:
      rows.insert(rows.end(), rows.begin(), rows.begin() + dice.pick(static_cast<int>(rows.size())));
      return "rows twice";
    case 5:
      for (Row& r : rows)
        if (dice.uniform() < 0.2) r.time_s = chosen.time_s;
      return "equal times";
    case 6: any().x_mm = 1e300; return "a coordinate of 1e300";
    case 7: any().y_mm = std::nan(""); return "a coordinate that is no number";
    case 8:
      for (Row& r : rows) r.x_mm += 9e5, r.y_mm -= 9e5;
      return "coordinates about 1e6";
    case 9:
      for (Row& r : rows) r.heading_rad = dice.uniform() < 0.5 ? std::nan("") : r.heading_rad;
      return "missing headings";
    case 10:
      for (Row& r : rows) r.heading_rad = chosen.heading_rad;
      return "equal headings";
    case 11:
      std::erase_if(rows, [&](const Row& r) { return of_chosen(r) && r.time_s > 1; });
      return "a track of 1 s";
    case 12:
      for (Row& r : rows)
        if (of_chosen(r)) r.time_s += 3e5;
      return "a robot 3e5 s later";
    case 13:
      for (Row& r : rows)
        if (of_chosen(r)) r.robot = 4294967295U;
      return "robot number 4294967295";
    case 14: any().time_s += 1e-9; return "a time off by 1 ns";
    case 15:
      for (std::size_t i = 0; i < rows.size(); i += 7) rows[i].x_mm += 400;
      return "every seventh position elsewhere";
    case 16: std::reverse(rows.begin(), rows.end()); return "rows in reverse";
    default:
      for (Row& r : rows) r.time_s -= 50;
      return "negative times";
  }
}

/// One oddity of the text of a file.
std::string spoil_text(std::string& text, Dice& dice) {
  switch (dice.pick(5)) {
    case 0: text.clear(); return "an empty file";
    case 1: text = text.substr(0, text.find('\n') + 1); return "no rows below the header";
    case 2:
      text = text.substr(0, static_cast<std::size_t>(dice.uniform() * static_cast<double>(text.size())));
      return "a file cut off";
    case 3:
      text.insert(static_cast<std::size_t>(dice.uniform() * static_cast<double>(text.size())), "x\"\0,");
      return "stray characters";
    default: {
      const std::size_t at = text.find("time_s");
      if (at != std::string::npos) text.replace(at, 6, "seconds");
      return "another name of a column";
    }
  }
}

std::string cell(double value) { return std::isnan(value) ? "" : fmt::format("{:.10g}", value); }

}  // namespace

OddSet odd_set(std::uint64_t seed) {
  Dice dice(seed * 0x9e3779b97f4a7c15 + 0x6f6464);
  const Layout l = layout_of(dice);
  const bool headings = dice.uniform() < 0.5;
  OddSet set;
  if (l.commands) set.commands = "run,robot,time_s,motion\n";
  std::vector<Row> rows;
  for (int run = 0; run < l.runs; ++run)
    for (int robot = 0; robot < l.robots; ++robot)
      if (dice.uniform() < 0.95)
        drive(l, dice, fmt::format("r{}", run), run * l.apart_mm, static_cast<std::uint32_t>(robot), rows,
              set.commands);
  set.oddities.push_back(fmt::format("{} robots, {} runs {:.0f} m apart, {:.0f} s, every {} s", l.robots, l.runs,
                                     l.apart_mm / 1000, l.duration_s, l.sample_s));
  while (dice.uniform() < 0.45) set.oddities.push_back(spoil(rows, dice));
  set.trajectories = headings ? "run,robot,time_s,x_mm,y_mm,heading_rad\n" : "run,robot,time_s,x_mm,y_mm\n";
  for (const Row& r : rows) {
    set.trajectories += fmt::format("{},{},{},{},{}", r.run, r.robot, cell(r.time_s), cell(r.x_mm), cell(r.y_mm));
    set.trajectories += headings ? fmt::format(",{}\n", cell(r.heading_rad)) : "\n";
  }
  if (dice.uniform() < 0.07) set.oddities.push_back(spoil_text(set.trajectories, dice));
  if (l.commands && dice.uniform() < 0.07) set.oddities.push_back("commands: " + spoil_text(set.commands, dice));
  return set;
}

void write_odd_set(const OddSet& set, const std::filesystem::path& directory) {
  std::filesystem::create_directories(directory);
  std::ofstream(directory / "trajectories.csv", std::ios::binary) << set.trajectories;
  if (!set.commands.empty()) std::ofstream(directory / "commands.csv", std::ios::binary) << set.commands;
}

}  // namespace kilotwin::truth
