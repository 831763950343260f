// Effects do not depend on the partition grid or on a checkpoint: one list with all targets and covariates, and random lists.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "idl/experiment.pb.h"
#include "tests/services/physics/swarm.hpp"

namespace kilotwin {
namespace {

using proto::Effect, proto::Function;
using testing::make_plan;
using testing::Swarm;

constexpr std::uint32_t kRobots = 90;
const std::vector<std::string> kCovariates = [] {
  std::vector<std::string> names;
  for (int c = Function::TIME; c <= Function::Covariate_MAX; ++c)
    names.push_back(Function::Covariate_Name(static_cast<Function::Covariate>(c)));
  return names;
}();

bool is_own_motors(const std::string& covariate) { return covariate == "DUTY" || covariate == "MOTOR_TIME"; }

/// Parameters that a covariate needs.
std::string with(const std::string& covariate, const std::string& radius_mm = "80") {
  if (covariate == "PLACE") return " field: 'driven'";
  if (covariate == "POINT_DISTANCE")
    return " point { x_mm: 50 y_mm: -20 velocity_x_mm_s: 9 velocity_y_mm_s: -4 growth_mm_s: 6 }";
  if (covariate == "ALONG") return " along_deg: 37";
  const bool of_neighbours = covariate == "NEIGHBOURS" || covariate == "NEAREST" || covariate == "DENSITY" ||
                             covariate == "NEAREST_BEARING";
  return of_neighbours ? " radius_mm: " + radius_mm : "";
}

const std::string kFields =
    "field { name: 'driven' cell_mm: 45 } field { name: 'visits' counts: VISITS cell_mm: 70 forget_s: 3 } "
    "field { name: 'present' counts: PRESENT_TIME cell_mm: 120 forget_s: 20 } "
    "field { name: 'trail' counts: TRAIL cell_mm: 60 forget_s: 5 corner_x_mm: 7 } ";

/// One effect per covariate, cycling through the targets, and one per shape.
std::string everything() {
  const char* const targets[] = {"WHEEL_GAIN", "WHEEL_OFFSET", "TURN_RATE", "BODY_DRIFT direction_deg: 70",
                                 "WORLD_DRIFT direction_deg: -20"};
  std::string text = kFields;
  int n = 0;
  const auto add = [&](const std::string& target, const std::string& function) {
    text +=
        "effect { name: 'e" + std::to_string(n++) + "' acts_on: " + target + " function { " + function + " } } ";
  };
  for (std::size_t c = 0; c < kCovariates.size(); ++c) {
    const std::string target = is_own_motors(kCovariates[c]) ? "WHEEL_GAIN" : targets[c % 5];
    add(target, "of: " + kCovariates[c] + with(kCovariates[c]) + " linear { at_zero: 0.02 slope: 0.0007 }");
  }
  add("TURN_RATE", "of: DENSITY radius_mm: 90 focus: 3 toward_deg: -60 linear { slope: 0.001 }");
  add("TURN_RATE", "of: NEIGHBOURS radius_mm: 80 others: DRIVEN_OTHERS linear { slope: 0.02 }");
  add("WHEEL_GAIN", "of: DENSITY radius_mm: 70 others: RESTING_OTHERS linear { slope: -0.05 }");
  add("BODY_DRIFT", "of: NEAREST radius_mm: 80 other_robot: [7, 3, 60, 90] linear { slope: 0.01 }");
  add("WORLD_DRIFT direction_deg: 45 during: [STOP, LEFT]",
      "of: X and_of: Y spline_2d { knot: [-300, 0, 300] and_knot: [-300, 300] value: [1, -1, 2, 0, 1, -2] }");
  add("TURN_RATE during: [STOP, STRAIGHT]", "noise { sd: 0.1 correlation_s: 2 }");
  add("WHEEL_GAIN", "constant: -0.6 } function { episodes { mean_apart_s: 1 scale_s: 0.4 tail: 1.5 }");
  add("WHEEL_OFFSET wheel: RIGHT_WHEEL", "noise { sd: 0.2 correlation_s: 0.5 } } function { noise { sd: 0.5 }");
  add("WHEEL_GAIN",
      "of: HEADING harmonic { cosine: 0.1 } } function { of: DRIVEN_TIME forget_s: 4 exponential { at_zero: 1 "
      "scale: 5 }");
  add("BODY_DRIFT", "of: PLACE field: 'visits' steps { at: [1, 2.5] value: [0, 1, -1] }");
  add("BODY_DRIFT direction_deg: 180", "of: PLACE field: 'present' spline { knot: [0, 1, 5] value: [0, 2, 0] }");
  add("WHEEL_GAIN", "of: PLACE field: 'trail' linear { slope: -0.4 }");
  add("WHEEL_GAIN robot: [3, 4, 5, 60]", "of: ROBOT table { key: [3, 60] value: [0.3, -0.3] otherwise: 0.1 }");
  return text;
}

void drive(Swarm& swarm, std::uint32_t tick) {
  drive(swarm, kRobots, tick);
  for (std::uint32_t r = 0; tick % 40 == 0 && r < kRobots; ++r) swarm.kick(r);
}

/// Input before each step: a real robot that moves.
std::vector<testing::TrackedPlace> tracked(std::uint32_t tick) {
  if (tick % 5 != 0) return {};
  return {{kRobots, 280 * std::cos(tick * 0.01), 280 * std::sin(tick * 0.013), 0.1 * tick - 3}};
}

std::string experiment(const std::string& engine, const std::string& effects) {
  return "arena { width_mm: 640 height_mm: 640 } physics { engine: " + engine +
         " } duration_s: 30 robots { count: " + std::to_string(kRobots) + " } robots { count: 1 body: TRACKED } " +
         effects;
}

std::vector<testing::ScenePose> crowd(std::uint64_t seed) {
  return testing::random_crowd(kRobots + 1, 600, 600, 33, seed);
}

class EffectPartitions : public ::testing::TestWithParam<std::string> {};

TEST_P(EffectPartitions, AnyGridGivesTheSameBits) {
  const std::string text = experiment(GetParam(), everything());
  const auto start = crowd(5);
  for (const auto& [columns, rows] : {std::pair{2u, 1u}, {1u, 2u}, {3u, 3u}, {8u, 1u}}) {
    const RunPlan whole = make_plan(text, start), cut = make_plan(text, start, columns, rows, columns);
    Swarm a(whole), b(cut);
    for (std::uint32_t k = 0; k < 130; ++k) {
      for (Swarm* s : {&a, &b}) {
        drive(*s, k);
        s->step(tracked(k));
      }
      ASSERT_EQ(a.hash(), b.hash()) << columns << "x" << rows << " tick " << k;
    }
    EXPECT_NE(a.poses()[0].x_mm, start[0].x_mm);
  }
}

TEST_P(EffectPartitions, ACheckpointOfOneGridContinuesOnAnother) {
  const std::string text = experiment(GetParam(), everything());
  const auto start = crowd(6);
  const RunPlan columns = make_plan(text, start, 2, 1), rows = make_plan(text, start, 1, 2),
                one = make_plan(text, start);
  Swarm a(columns), b(rows), c(one);
  std::uint32_t k = 0;
  for (; k < 90; ++k) {
    drive(a, k);
    a.step(tracked(k));
  }
  b.load(a.tick(), a.save());
  c.load(a.tick(), a.save());
  EXPECT_EQ(a.hash(), b.hash());
  EXPECT_EQ(a.hash(), c.hash());
  for (; k < 160; ++k) {
    for (Swarm* s : {&a, &b, &c}) {
      drive(*s, k);
      s->step(tracked(k));
    }
    ASSERT_EQ(a.hash(), b.hash()) << k;
    ASSERT_EQ(a.hash(), c.hash()) << k;
  }
}

TEST_P(EffectPartitions, EveryEffectChangesTheHash) {
  const auto start = crowd(7);
  const std::string all = everything();
  const auto hash_of = [&](const std::string& effects) {
    const RunPlan plan = make_plan(experiment(GetParam(), effects), start);
    Swarm swarm(plan);
    for (std::uint32_t k = 0; k < 60; ++k) {
      drive(swarm, k);
      swarm.step(tracked(k));
    }
    double sum = 0;
    for (const auto& pose : swarm.poses()) sum += pose.x_mm + pose.y_mm * 3 + pose.heading_rad * 7;
    return sum;
  };
  const double with_all = hash_of(all);
  for (std::size_t at = all.find("effect {"); at != std::string::npos; at = all.find("effect {", at + 1)) {
    const std::size_t end = all.find("effect {", at + 1);
    const std::string one = all.substr(at, end == std::string::npos ? end : end - at);
    EXPECT_NE(hash_of(all.substr(0, at) + (end == std::string::npos ? "" : all.substr(end))), with_all) << one;
  }
}

/// A random list of effects that validation accepts, with numbers of all magnitudes.
std::string random_effects(std::mt19937& engine) {
  const auto below = [&](std::size_t n) { return engine() % n; };
  const auto number = [&] {
    const double mantissa = static_cast<double>(engine()) / 2147483648.0 - 1;
    return std::to_string(std::ldexp(mantissa, static_cast<int>(below(12)) - 8));
  };
  std::string text = kFields;
  const std::size_t effects = 1 + below(6);
  for (std::size_t e = 0; e < effects; ++e) {
    const auto target = static_cast<Effect::Target>(below(Effect::Target_MAX + 1));
    const bool on_wheels = target == Effect::WHEEL_GAIN || target == Effect::WHEEL_OFFSET;
    text += "effect { name: 'r" + std::to_string(e) + "' acts_on: " + Effect::Target_Name(target);
    if (on_wheels && below(2) == 0) text += below(2) == 0 ? " wheel: LEFT_WHEEL" : " wheel: RIGHT_WHEEL";
    if (below(4) == 0) text += " during: [STOP, RIGHT]";
    if (below(4) == 0) text += " robot: [1, 2, 50]";
    for (std::size_t f = 0, functions = 1 + below(3); f < functions; ++f) {
      std::string covariate = kCovariates[below(kCovariates.size())];
      if ((is_own_motors(covariate) && !on_wheels) || (covariate == "PLACE" && target >= Effect::MEASURED_OFFSET))
        covariate = "TIME";
      text += " function { ";
      const std::string of = "of: " + covariate + with(covariate, std::to_string(1 + below(150)));
      switch (below(8)) {
        case 0: text += "constant: " + number(); break;
        case 1: text += of + " linear { at_zero: " + number() + " slope: " + number() + " }"; break;
        case 2:
          text += of + " exponential { at_zero: " + number() + " scale: " + (below(2) == 0 ? "-" : "") + "0.75 }";
          break;
        case 3: text += of + " harmonic { sine: " + number() + " period: 3 }"; break;
        case 4:
          text +=
              of + " spline { knot: [-1, 0, 20] value: [" + number() + ", " + number() + ", " + number() + "] }";
          break;
        case 5: text += of + " steps { at: 1 value: [" + number() + ", " + number() + "] }"; break;
        case 6:
          text += of + " and_of: Y spline_2d { knot: [0, 5] and_knot: [-9, 9] value: [1, 2, 3, " + number() + "] }";
          break;
        default: text += "noise { sd: 0.5" + std::string(below(2) == 0 ? " correlation_s: 1.5" : "") + " }";
      }
      text += " }";
    }
    text += " } ";
  }
  return text;
}

TEST_P(EffectPartitions, RandomListsGiveTheSameBitsAndStayFinite) {
  std::mt19937 engine{GetParam() == "PLANAR" ? 1u : 2u};
  for (int list = 0; list < 25; ++list) {
    const std::string text = experiment(GetParam(), random_effects(engine));
    const auto start = crowd(100 + static_cast<std::uint64_t>(list));
    const RunPlan whole = make_plan(text, start), cut = make_plan(text, start, 3, 2, 2);
    Swarm a(whole), b(cut), c(whole);
    for (std::uint32_t k = 0; k < 30; ++k) {
      for (Swarm* s : {&a, &b}) {
        drive(*s, k);
        s->step(tracked(k));
      }
      ASSERT_EQ(a.hash(), b.hash()) << text << k;
    }
    c.load(b.tick(), b.save());
    EXPECT_EQ(c.hash(), a.hash()) << text;
    const auto after = a.poses();
    for (const auto& pose : after) {
      ASSERT_TRUE(std::isfinite(pose.x_mm) && std::isfinite(pose.y_mm) && std::isfinite(pose.heading_rad)) << text;
    }
  }
}

TEST(EffectContacts, RobotsThatPushBodiesGiveTheSameBits) {
  // A beam across many partitions carries the influence of neighbours from one end to the other.
  std::vector<testing::ScenePose> start;
  for (int i = 0; i < 40; ++i)
    start.push_back({-1170 + 60.0 * i, i % 2 == 0 ? 40.0 : -40.0, i % 2 == 0 ? -1.5 : 1.5});
  const auto text =
      "arena { width_mm: 2500 height_mm: 640 } duration_s: 30 movable { mass_g: 20 box { width_mm: 2300 "
      "length_mm: 20 } } " +
      everything();
  const RunPlan whole = make_plan(text, start), cut = make_plan(text, start, 10, 1, 2);
  Swarm a(whole), b(cut);
  for (std::uint32_t k = 0; k < 120; ++k) {
    for (Swarm* s : {&a, &b}) {
      for (std::uint32_t r = 0; r < start.size(); ++r) s->set_motors(r, r % 5 != 0 ? 70 : 0, 70);
      s->step();
    }
    ASSERT_EQ(a.hash(), b.hash()) << k;
  }
}

TEST(EffectContacts, RobotsThatDriftTogetherDoNotOverlap) {
  const RunPlan plan = make_plan(
      "arena { width_mm: 500 height_mm: 500 } motion { noise: false } "
      "effect { name: 'x' acts_on: WORLD_DRIFT during: STOP function { of: X linear { slope: -0.3 } } } "
      "effect { name: 'y' acts_on: WORLD_DRIFT direction_deg: 90 during: STOP function { of: Y linear { slope: "
      "-0.3 } } } "
      "effect { name: 'z' acts_on: TURN_RATE during: STOP function { constant: 3 } }",
      testing::random_crowd(60, 450, 450, 33.5, 3));
  Swarm swarm(plan);
  for (int k = 0; k < 400; ++k) {
    swarm.step();
    ASSERT_LT(testing::largest_overlap_mm(swarm.poses()), 1e-9) << k;
  }
  double widest = 0;
  for (const auto& pose : swarm.poses()) widest = std::max({widest, std::abs(pose.x_mm), std::abs(pose.y_mm)});
  EXPECT_LT(widest, 180);  // 60 discs in the tightest packing reach 140 mm
}

INSTANTIATE_TEST_SUITE_P(Engines, EffectPartitions, ::testing::Values("PLANAR", "KINEMATIC"),
                         [](const auto& tested) { return tested.param; });

}  // namespace
}  // namespace kilotwin
