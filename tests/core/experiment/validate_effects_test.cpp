// Validation of effects and fields: errors name the place, what is wrong and what would be right.
#include "scratch.hpp"

namespace kilotwin::test {
namespace {

class ValidateEffects : public Scratch {};

const std::string kRobots = "robots { count: 4 behaviour: 'a.c' }\n";

TEST_F(ValidateEffects, AcceptsValidEffects) {
  EXPECT_EQ(
      check_error(
          kRobots +
          "effect { name: 'slope' acts_on: WORLD_DRIFT direction_deg: 30 during: [STRAIGHT, STOP] robot: [0, 3]\n"
          "  function { of: X and_of: Y spline_2d { knot: [0, 1] and_knot: [0, 1] value: [1, 2, 3, 4] } } }\n"
          "effect { name: 'tired' acts_on: WHEEL_GAIN wheel: LEFT_WHEEL function { of: MOTOR_TIME forget_s: 60 "
          "linear { slope: -0.001 } }\n"
          "  function { noise { sd: 0.1 } } }\n"
          "effect { name: 'worn' acts_on: WHEEL_GAIN function { of: PLACE field: 'f' steps { at: 3 value: [0, 1] } "
          "} }\n"
          "effect { name: 'lens' acts_on: MEASURED_SCALE function { of: RADIUS linear { slope: 1e-5 } } }\n"
          "field { name: 'f' }\n"),
      "");
}

TEST_F(ValidateEffects, TablesTakeCommandsAndTheirNumber) {
  for (const std::string of :
       {"COMMAND", "PREVIOUS_COMMAND", "LAST_TURN", "EARLIER_TURN", "COMMAND_COUNT", "ROBOT", "RUN"}) {
    const std::string effect =
        "effect { name: 'a' acts_on: TURN_RATE function { of: " + of + " table { key: [2, 3] value: [1, 2] } } }";
    EXPECT_EQ(check_error(kRobots + effect), "") << of;
  }
}

TEST_F(ValidateEffects, DistancesNeedTheirPoint) {
  const std::string head = kRobots + "effect { name: 'a' acts_on: WHEEL_GAIN\n function { ";
  EXPECT_EQ(check_error(head + "of: POINT_DISTANCE point { x_mm: 50 growth_mm_s: 2 } linear { } } }"), "");
  EXPECT_EQ(check_error(head + "of: POINT_DISTANCE linear { } } }"),
            "e.txtpb:3:2: point is missing; state the centre of the circles, point { x_mm: ... y_mm: ... }");
  EXPECT_EQ(check_error(head + "of: X point { x_mm: 50 } linear { } } }"),
            "e.txtpb:3:19: point has no effect here; it goes with of: POINT_DISTANCE");
}

TEST_F(ValidateEffects, ADirectionGoesWithPlacesAlongIt) {
  const std::string head = kRobots + "effect { name: 'a' acts_on: WHEEL_GAIN\n function { ";
  EXPECT_EQ(check_error(head + "of: ALONG along_deg: 30 linear { } } }"), "");
  EXPECT_EQ(check_error(head + "of: ALONG linear { } } }"), "");
  EXPECT_EQ(check_error(head + "of: X along_deg: 30 linear { } } }"),
            "e.txtpb:3:19: along_deg has no effect here; it goes with of: ALONG");
}

TEST_F(ValidateEffects, EpisodesNeedRateAndLength) {
  const std::string head =
      kRobots + "effect { name: 'a' acts_on: WHEEL_GAIN function { constant: -1 }\n function { ";
  EXPECT_EQ(check_error(head + "episodes { mean_apart_s: 100 scale_s: 5 tail: 1.5 shape: 3 } } }"), "");
  EXPECT_EQ(check_error(head + "episodes { mean_apart_s: 100 scale_s: 5 shape: 0 } } }"),
            "e.txtpb:3:53: shape is 0; it takes a number, 0.1..100");
  EXPECT_EQ(check_error(head + "episodes { scale_s: 5 } } }"),
            "e.txtpb:3:13: mean_apart_s is missing; state the mean time from the end of an episode to the next");
  EXPECT_EQ(check_error(head + "episodes { mean_apart_s: 5 } } }"),
            "e.txtpb:3:13: scale_s is missing; state the scale of the episodes' lengths");
  EXPECT_EQ(
      check_error(
          kRobots +
          "effect { name: 'a' acts_on: MEASURED_SCALE function {\n episodes { mean_apart_s: 5 scale_s: 1 } } }"),
      "e.txtpb:3:2: episodes are known to what moves robots alone; take them with a gain, an offset, a turn rate "
      "or a drift");
}

struct BadEffect {
  const char* text;
  const char* error;
};

TEST_F(ValidateEffects, ErrorsNameTheirPlace) {
  const BadEffect cases[] = {
      {"effect { acts_on: WHEEL_GAIN function { constant: 1 } }",
       "e.txtpb:2:1: name is missing; state name: \"...\", one that no other effect has"},
      {"effect { name: 'a b' acts_on: WHEEL_GAIN function { constant: 1 } }",
       "e.txtpb:2:10: name is \"a b\"; it takes 1 to 100 letters, digits, '-' and '_'"},
      {"effect { name: 'a' function { constant: 1 } }",
       "e.txtpb:2:1: acts_on is missing; state what the effect acts on, e.g. acts_on: WHEEL_GAIN"},
      {"effect { name: 'a' acts_on: GAIN }",
       "e.txtpb:2:29: acts_on is GAIN; it takes one of WHEEL_GAIN, WHEEL_OFFSET, TURN_RATE, BODY_DRIFT, "
       "WORLD_DRIFT, MEASURED_OFFSET, MEASURED_BODY_OFFSET, MEASURED_SCALE, MEASURED_HEADING"},
      {"effect { name: 'a' acts_on: TURN_RATE }",
       "e.txtpb:2:1: there are 0 functions; it takes 1..8, function { ... }"},
      {"effect { name: 'a' acts_on: TURN_RATE wheel: LEFT_WHEEL function { constant: 1 } }",
       "e.txtpb:2:39: wheel has no effect here; it goes with acts_on: WHEEL_GAIN or WHEEL_OFFSET"},
      {"effect { name: 'a' acts_on: TURN_RATE direction_deg: 3 function { constant: 1 } }",
       "e.txtpb:2:39: direction_deg has no effect here; it goes with drifts and measured offsets"},
      {"effect { name: 'a' acts_on: TURN_RATE sum: 's' function { constant: 1 } }",
       "e.txtpb:2:39: sum has no effect here; it goes with acts_on: WHEEL_GAIN, since all others are added in any "
       "case"},
      {"effect { name: 'a' acts_on: TURN_RATE function { } }",
       "e.txtpb:2:39: function has no shape; it takes constant, linear, exponential, harmonic, spline, spline_2d, "
       "steps, table, noise or episodes"},
      {"effect { name: 'a' acts_on: TURN_RATE function { linear { } } }",
       "e.txtpb:2:39: of is missing; state what the function looks at, e.g. of: TIME"},
      {"effect { name: 'a' acts_on: TURN_RATE function { of: TIME constant: 3 } }",
       "e.txtpb:2:50: of has no effect here; a constant, noise and episodes look at nothing, remove it"},
      {"effect { name: 'a' acts_on: TURN_RATE function { of: NEAREST linear { } } }",
       "e.txtpb:2:39: radius_mm is missing; state how far away robots count, mm"},
      {"effect { name: 'a' acts_on: TURN_RATE function { of: TIME radius_mm: 5 linear { } } }",
       "e.txtpb:2:59: radius_mm has no effect here; it goes with NEIGHBOURS, NEAREST, DENSITY and NEAREST_BEARING"},
      {"effect { name: 'a' acts_on: TURN_RATE function { of: NEAREST radius_mm: 5 focus: 2 linear { } } }",
       "e.txtpb:2:75: focus has no effect here; it goes with NEIGHBOURS and DENSITY"},
      {"effect { name: 'a' acts_on: TURN_RATE function { of: TIME others: DRIVEN_OTHERS linear { } } }",
       "e.txtpb:2:59: others has no effect here; it goes with NEIGHBOURS, NEAREST, DENSITY and NEAREST_BEARING"},
      {"effect { name: 'a' acts_on: TURN_RATE function { of: TIME other_robot: 3 linear { } } }",
       "e.txtpb:2:59: other_robot has no effect here; it goes with NEIGHBOURS, NEAREST, DENSITY and "
       "NEAREST_BEARING"},
      {"effect { name: 'a' acts_on: TURN_RATE function { of: DENSITY radius_mm: 5 toward_deg: 2 linear { } } }",
       "e.txtpb:2:75: toward_deg has no effect here; it goes with a focus above 0"},
      {"effect { name: 'a' acts_on: TURN_RATE function { of: NEIGHBOURS radius_mm: 5 focus: 2 table { } } }",
       "e.txtpb:2:78: a table takes whole numbers, and with a focus neighbours add up to none; take another shape"},
      {"effect { name: 'a' acts_on: TURN_RATE function { of: MOTOR_TIME linear { } } }",
       "e.txtpb:2:50: MOTOR_TIME is that of a wheel's own motor, and the effect does not act on wheels; take one "
       "of the left or the right motor"},
      {"effect { name: 'a' acts_on: TURN_RATE function { of: PLACE linear { } } }",
       "e.txtpb:2:39: field is missing; state the name of an arena field, field: \"...\""},
      {"effect { name: 'a' acts_on: TURN_RATE function { of: PLACE field: 'g' linear { } } }",
       "e.txtpb:2:60: there is no arena field \"g\"; add field { name: \"g\" }, or name one that is there"},
      {"field { name: 'g' }\neffect { name: 'a' acts_on: MEASURED_SCALE function { of: PLACE field: 'g' linear { } "
       "} }",
       "e.txtpb:3:55: PLACE is known to what moves robots alone; take it with a gain, an offset, a turn rate or a "
       "drift"},
      {"effect { name: 'a' acts_on: TURN_RATE function { of: TIME spline { knot: [0, 2, 2] value: [1, 2, 3] } } }",
       "e.txtpb:2:68: 2 after 2 does not ascend; each knot is at least 1e-6 more than the one before"},
      {"effect { name: 'a' acts_on: TURN_RATE function { of: TIME spline { knot: [0, 2] value: 1 } } }",
       "e.txtpb:2:59: spline has 2 knots and 1 values; give as many of one as of the other"},
      {"effect { name: 'a' acts_on: TURN_RATE function { of: TIME spline_2d { } } }",
       "e.txtpb:2:39: and_of is missing; state the second variable of spline_2d, e.g. and_of: Y"},
      {"effect { name: 'a' acts_on: TURN_RATE function { of: X and_of: Y linear { } } }",
       "e.txtpb:2:56: and_of has no effect here; it is the second variable of spline_2d"},
      {"effect { name: 'a' acts_on: TURN_RATE function { of: TIME steps { value: 1 } } }",
       "e.txtpb:2:59: there are 0 of at; it takes 1..1000"},
      {"effect { name: 'a' acts_on: TURN_RATE function { of: TIME exponential { at_zero: 1 } } }",
       "e.txtpb:2:59: scale is missing; state how far off the difference has fallen to 1/e"},
      {"effect { name: 'a' acts_on: TURN_RATE function { of: TIME table { key: 1 value: 1 } } }",
       "e.txtpb:2:50: a table takes whole numbers, and TIME is none; take ROBOT, RUN, COMMAND, NEIGHBOURS or a "
       "duty, or another shape"},
      {"effect { name: 'a' acts_on: TURN_RATE function { of: ROBOT table { key: [1, 1] value: [1, 1] } } }",
       "e.txtpb:2:68: key 1 is given twice; give it once"},
      {"effect { name: 'a' acts_on: TURN_RATE function { noise { } } }",
       "e.txtpb:2:50: sd is missing; state the standard deviation"},
      {"effect { name: 'a' acts_on: TURN_RATE robot: [2, 2] function { constant: 1 } }",
       "e.txtpb:2:39: robot 2 is named twice; name it once"},
      {"effect { name: 'a' acts_on: TURN_RATE function { constant: 1 } }\neffect { name: 'a' acts_on: TURN_RATE "
       "function { constant: 1 } }",
       "e.txtpb:3:10: name is \"a\", as that of the effect at e.txtpb:2:1; give each its own"},
      {"effect { name: 'a' acts_on: TURN_RATE function { constant: inf } }",
       "e.txtpb:2:50: constant is inf; it takes a number, -1000000..1000000"},
      {"arena { width_mm: 1000000 height_mm: 1000000 } field { name: 'f' cell_mm: 20 }",
       "e.txtpb:2:66: cell_mm is 20, which cuts the arena into 2.5e+09 cells; make them so large that there are at "
       "most 4000000"},
  };
  for (const auto& [text, error] : cases) EXPECT_EQ(check_error(kRobots + text), error) << text;
}

TEST_F(ValidateEffects, AModelsListReplacesThatOfTheExperiment) {
  LoadedExperiment loaded = load(kRobots +
                                 "effect { name: 'a' acts_on: TURN_RATE function { constant: 1 } }\n"
                                 "effect { name: 'b' acts_on: TURN_RATE function { constant: 1 } }");
  apply_model(loaded, write("none.txtpb", "motion { noise: false }"));
  EXPECT_EQ(loaded.experiment.effect_size(), 2);
  apply_model(loaded, write("m.txtpb", "\neffect { name: 'c' acts_on: WORLD_DRIFT\n function { of: TIME } }"));
  ASSERT_EQ(loaded.experiment.effect_size(), 1);
  EXPECT_EQ(loaded.experiment.effect(0).name(), "c");
  EXPECT_EQ(error_of([&] { validate(loaded); }),
            "m.txtpb:3:2: function has no shape; it takes constant, linear, exponential, harmonic, spline, "
            "spline_2d, steps, table, noise or episodes");
}

TEST_F(ValidateEffects, EveryExampleOfTheDocumentRuns) {
  std::ifstream in{std::string{KILOTWIN_SOURCE_DIR} + "/docs/explanation/motion.md"};
  std::string line, block, shapes;
  int blocks = 0;
  const auto check = [&] {
    if (block.empty() || block.find("kilotwin ") == 4) {
      block.clear();
      return;
    }
    LoadedExperiment loaded = load(kRobots);
    EXPECT_EQ(error_of([&] {
                apply_model(loaded, write("example.txtpb", block));
                validate(loaded);
              }),
              "")
        << block;
    shapes += block;
    block.clear();
    ++blocks;
  };
  while (std::getline(in, line)) {
    if (line.starts_with("    ")) {
      block += line + "\n";
    } else {
      check();
    }
  }
  check();
  EXPECT_GE(blocks, 12);
  // Every target, every shape and every kind of covariate has one.
  for (int target = 0; target <= proto::Effect::Target_MAX; ++target) {
    const std::string name = proto::Effect::Target_Name(static_cast<proto::Effect::Target>(target));
    EXPECT_NE(shapes.find("acts_on: " + name), std::string::npos) << name;
  }
  for (const char* const shape :
       {"constant", "linear", "exponential", "harmonic", "spline", "spline_2d", "steps", "table", "noise"})
    EXPECT_NE(shapes.find(shape), std::string::npos) << shape;
  std::ifstream again{std::string{KILOTWIN_SOURCE_DIR} + "/docs/explanation/motion.md"};
  const std::string all{std::istreambuf_iterator<char>(again), {}};
  for (int c = proto::Function::TIME; c <= proto::Function::Covariate_MAX; ++c) {
    const std::string name = proto::Function::Covariate_Name(static_cast<proto::Function::Covariate>(c));
    EXPECT_NE(all.find("`" + name + "`"), std::string::npos) << name;
  }
}

}  // namespace
}  // namespace kilotwin::test
