#include <google/protobuf/text_format.h>

#include "core/experiment/radio_population.hpp"
#include "scratch.hpp"

namespace kilotwin::test {
namespace {

class Load : public Scratch {};

TEST_F(Load, NamesTheExperimentAfterItsFile) {
  EXPECT_EQ(load_experiment(write("my swarm.v2.txtpb", "")).experiment.name(), "my-swarm-v2");
  EXPECT_EQ(load("name: \"other\"").experiment.name(), "other");
}

TEST_F(Load, RemembersThePlacesOfFields) {
  const LoadedExperiment loaded =
      load("seed: 2\nrobots {\n  count: 3\n  layout {\n\tgrid { pitch_mm: 50 }\n  }\n}\nrobots {}\n");
  const auto at = [&](const char* path) { return error_of([&] { throw loaded.locations.error(path, "x"); }); };
  EXPECT_EQ(at("seed"), "e.txtpb:1:1: x");
  EXPECT_EQ(at("robots[0].layout.grid.pitch_mm"), "e.txtpb:5:16: x");
  EXPECT_EQ(at("robots[0].layout.grid.columns"), "e.txtpb:5:9: x");  // absent: its message
  EXPECT_EQ(at("robots[1].layout.grid"), "e.txtpb:8:1: x");
  EXPECT_EQ(at("robots"), "e.txtpb:2:1: x");
  EXPECT_EQ(at("arena.width_mm"), "e.txtpb:1:1: x");
}

struct BadSyntax {
  const char* text;
  const char* error;
};

TEST_F(Load, SyntaxErrorsNameTheWordAndTheRemedy) {
  const BadSyntax cases[] = {
      {"arena {\n  widht_mm: 3\n}", "e.txtpb:2:3: unknown field widht_mm in arena; did you mean width_mm?"},
      {"robot { count: 3 }", "e.txtpb:1:1: unknown field robot; did you mean robots?"},
      {"arena { gravity: 3 }",
       "e.txtpb:1:9: unknown field gravity in arena; its fields are width_mm, height_mm, circle, polygon"},
      {"radio { range_mm: \"far\" }", "e.txtpb:1:19: range_mm is \"far\"; it takes a number, above 33 mm"},
      {"radio { range_mm: far }", "e.txtpb:1:19: range_mm is far; it takes a number, above 33 mm"},
      {"arena { width_mm: -wide }", "e.txtpb:1:19: width_mm is -wide; it takes a number, 40..1000000 mm"},
      {"duration_s: { }", "e.txtpb:1:13: duration_s is {; it takes a number, above 0, at most 1000000 s"},
      {"robots { count: -3 }", "e.txtpb:1:17: count is -3; it takes a whole number, 1..100000 robots"},
      {"robots { count: 2.5 }", "e.txtpb:1:17: count is 2.5; it takes a whole number, 1..100000 robots"},
      {"robots { count: 99999999999 }",
       "e.txtpb:1:17: count is 99999999999; it takes a whole number, 1..100000 robots"},
      {"seed: 18446744073709551616", "e.txtpb:1:7: seed is 18446744073709551616; it takes a whole number"},
      {"motion { noise: maybe }", "e.txtpb:1:17: noise is maybe; it takes true or false"},
      {"motion { noise: 2 }", "e.txtpb:1:17: noise is 2; it takes true or false"},
      {"name: 3", "e.txtpb:1:7: name is 3; it takes text in quotes"},
      {"name: disperse", "e.txtpb:1:7: name is disperse; it takes text in quotes"},
      {"robots { body: REAL }", "e.txtpb:1:16: body is REAL; it takes one of SIMULATED, TRACKED"},
      {"robots { body: 7 }", "e.txtpb:1:16: body is 7; it takes one of SIMULATED, TRACKED"},
      {"arena: 3", "e.txtpb:1:8: arena is 3; it takes a block, arena { ... }"},
      {"arena 3", "e.txtpb:1:7: arena is followed by 3; write arena { ... }"},
      {"seed 3", "e.txtpb:1:6: seed is followed by 3; write seed: and a whole number"},
      {"seed:\n", "e.txtpb:2:1: seed is left without a value; it takes a whole number"},
      {"robots {\n  layout {\n    grid { }\n  }\n",
       "e.txtpb:5:1: the block robots of line 1 is not closed; end it with }"},
      {"arena { }\n}", "e.txtpb:2:1: a closing } has no block to close; remove it"},
      {"seed: 1\nseed: 2", "e.txtpb:2:1: seed is given twice; give it once"},
      {"robots { layout { grid { }\nrings { } } }",
       "e.txtpb:2:1: rings is a second shape; give one of grid, rings, random, poses"},
      {"robots: [{ count: 3 }, { body: SIMULATED\n cout: 3 }]",
       "e.txtpb:2:2: unknown field cout in robots; did you mean count?"},
      {"robots: [{ count: 3 }, 5]", "e.txtpb:1:24: robots is 5; it takes a block, robots { ... }"},
      {"seed: 0x1F, arena: < width_mm: -inf; height_mm: 1f > name: \"a\" 'b' motion { noise: t } robot",
       "e.txtpb:1:88: unknown field robot; did you mean robots?"},
      {"name: \"open",
       "e.txtpb:1:12: Unexpected end of string; write fields as name: value and blocks as name { ... }"},
      {"robots { layout { rings { count: [1, x] } } }",
       "e.txtpb:1:38: count is x; it takes a whole number, 1..100000 robots"},
  };
  for (const auto& [text, error] : cases) EXPECT_EQ(load_error(text), error) << text;
}

TEST_F(Load, FilesThatCannotBeRead) {
  EXPECT_EQ(error_of([&] { static_cast<void>(load_experiment(dir_ / "none.txtpb")); }),
            "none.txtpb:1:1: none.txtpb cannot be read (No such file or directory); name a file that exists and "
            "may be read");
  EXPECT_EQ(error_of([&] { static_cast<void>(load_experiment(dir_)); }),
            dir_.string() + ":1:1: " + dir_.string() + " is a directory; name a file");
}

TEST_F(Load, SurvivesDeepAndHugeFiles) {
  std::string deep;
  for (int i = 0; i < 300'000; ++i) deep += "a{";
  EXPECT_EQ(load_error(deep).substr(0, 34), "e.txtpb:1:1: unknown field a; its ");
  std::string list = "robots { layout { rings { count: [1";
  for (int i = 0; i < 300'000; ++i) list += ",[";
  EXPECT_NE(load_error(list), "");
  EXPECT_NE(load_error("name: \"" + std::string(5'000'000, 'x')), "");
  EXPECT_LT(load_error(std::string(5'000'000, 'x') + ": 3").size(), 400u);
  EXPECT_EQ(load_error(std::string(std::size_t{33} << 20, ' ')),
            "e.txtpb:1:1: e.txtpb has more than 32 MiB; files of this kind are smaller");
  std::string counts = "robots { behaviour: 'a.c' layout { rings {";
  for (int i = 0; i < 200'000; ++i) counts += " count: 1";
  EXPECT_EQ(check_error(counts + "} } }"),
            "e.txtpb:1:36: rings has 200000 count and 0 radius_mm; give as many of one as of the other, at least "
            "one each");
}

TEST_F(Load, ModelReplacesTheFieldsThatItStates) {
  LoadedExperiment loaded = load(
      "motion { bias_sd_mm_s: 3 wheel_base_mm: 20 }\n"
      "robot_model { robot: 4 bias_left_mm_s: 1 bias_right_mm_s: 2 }\n"
      "robots { count: 9 behaviour: 'a.c' }");
  apply_model(loaded, write("m.txtpb",
                            "motion { wheel_base_mm: 30 }\nrobot { robot: 4 bias_left_mm_s: 5 }\n"
                            "robot { robot: 7\n  bias_left_mm_s: -500 }\n"));
  proto::Experiment expected;
  ASSERT_TRUE(google::protobuf::TextFormat::ParseFromString(
      "name: 'e' motion { bias_sd_mm_s: 3 wheel_base_mm: 30 } robot_model { robot: 4 bias_left_mm_s: 5 "
      "bias_right_mm_s: 2 }"
      "robot_model { robot: 7 bias_left_mm_s: -500 } robots { count: 9 behaviour: 'a.c' }",
      &expected));
  EXPECT_EQ(loaded.experiment.DebugString(), expected.DebugString());
  EXPECT_EQ(error_of([&] { validate(loaded); }),
            "m.txtpb:4:3: bias_left_mm_s is -500; it takes a number, -100..100 mm/s");
}

TEST_F(Load, PropagationWithoutABlockIsThatOfTheMeasuredRobots) {
  proto::Experiment stated = load("radio { model: PROPAGATION }").experiment;
  use_measured_radio(stated);
  LoadedExperiment fitted = load("radio { model: PROPAGATION }");
  apply_model(fitted, std::filesystem::path(KILOTWIN_SOURCE_DIR) / "experiments/models/radio-25-robots.txtpb");
  const proto::Radio &radio = stated.radio(), &expected = fitted.experiment.radio();
  const auto same = [](double a, double b) { EXPECT_NEAR(a, b, 1e-3 * std::abs(b)); };
  same(radio.range_mm(), expected.range_mm());
  same(radio.oscillator_sd(), expected.oscillator_sd());
  const google::protobuf::Reflection& fields = *radio.propagation().GetReflection();
  std::vector<const google::protobuf::FieldDescriptor*> given;
  fields.ListFields(expected.propagation(), &given);
  EXPECT_GT(given.size(), 10U);
  for (const auto* field : given) {
    if (!field->is_repeated()) {
      same(fields.GetDouble(radio.propagation(), field), fields.GetDouble(expected.propagation(), field));
      continue;
    }
    const int entries = fields.FieldSize(expected.propagation(), field);
    ASSERT_EQ(fields.FieldSize(radio.propagation(), field), entries);
    for (int i = 0; i < entries; ++i)
      same(fields.GetRepeatedDouble(radio.propagation(), field, i),
           fields.GetRepeatedDouble(expected.propagation(), field, i));
  }
  // Values that an experiment states remain.
  for (const char* text :
       {"radio { model: PROPAGATION propagation { power_sd_db: 2 } }", "radio { model: DISC }"}) {
    proto::Experiment own = load(text).experiment;
    const std::string before = own.DebugString();
    use_measured_radio(own);
    EXPECT_EQ(own.DebugString(), before);
  }
  proto::Experiment ranged = load("radio { model: PROPAGATION range_mm: 90 }").experiment;
  use_measured_radio(ranged);
  EXPECT_EQ(ranged.radio().range_mm(), 90);
}

TEST_F(Load, ModelErrorsNameTheModelFile) {
  LoadedExperiment loaded = load("");
  const auto model_error = [&](const char* text) {
    return error_of([&] { apply_model(loaded, write("m.txtpb", text)); });
  };
  EXPECT_EQ(model_error("motion { wheelbase_mm: 3 }"),
            "m.txtpb:1:10: unknown field wheelbase_mm in motion; did you mean wheel_base_mm?");
  EXPECT_EQ(model_error("\nrobot { bias_left_mm_s: 5 }"),
            "m.txtpb:2:1: robot is missing; state robot: ID, the robot that the entry is about");
  EXPECT_EQ(model_error("robot { robot: 1 }\nrobot { robot: 1 }"),
            "m.txtpb:2:1: robot 1 has an entry already, at m.txtpb:1:1; keep one of them");
  EXPECT_EQ(loaded.experiment.robot_model_size(), 0);
}

TEST(Shipped, ExperimentsAreValid) {
  const std::filesystem::path folder = std::filesystem::path{KILOTWIN_SOURCE_DIR} / "experiments";
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator{folder}) {
    if (entry.path().extension() != ".txtpb") continue;
    ++files;
    EXPECT_NO_THROW(validate(load_experiment(entry.path()))) << entry.path();
  }
  EXPECT_GE(files, 2);
}

}  // namespace
}  // namespace kilotwin::test
