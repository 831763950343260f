#include "scratch.hpp"

namespace kilotwin::test {
namespace {

class Override : public Scratch {
 protected:
  std::string override_error(const std::string& argument) const {
    LoadedExperiment loaded = load("robots { count: 4 behaviour: 'a.c' }");
    const std::string before = loaded.experiment.SerializeAsString();
    const std::string error = error_of([&] { apply_override(loaded, argument); });
    EXPECT_EQ(loaded.experiment.SerializeAsString(), before)
        << argument << " changed the experiment though it failed";
    return error;
  }
};

TEST_F(Override, SetsFieldsOfEveryType) {
  LoadedExperiment loaded = load("robots { count: 4 behaviour: 'a.c' layout { grid { } } }");
  for (const char* argument :
       {"duration_s=1.5e1", "seed=18446744073709551615", "name=two words?", "motion.noise=false",
        "robots.body=TRACKED", "robots.behaviour=b.c", "robots[0].behaviour[1]=c=d.c", "robots[1].count=7",
        "robots[1].layout.rings.count=3", "robots[1].layout.rings.count[1]=6",
        "robots[1].layout.rings.radius_mm=50", "robots.layout.random.min_gap_mm=2",
        "station.environment.hub.radius_mm=7"}) {
    apply_override(loaded, argument);
  }
  const proto::Experiment& e = loaded.experiment;
  EXPECT_EQ(e.duration_s(), 15);
  EXPECT_EQ(e.seed(), 18446744073709551615u);
  EXPECT_EQ(e.name(), "two words?");
  EXPECT_FALSE(e.motion().noise());
  EXPECT_EQ(e.robots(0).body(), proto::RobotGroup::TRACKED);
  ASSERT_EQ(e.robots(0).behaviour_size(), 2);
  EXPECT_EQ(e.robots(0).behaviour(0), "b.c");
  EXPECT_EQ(e.robots(0).behaviour(1), "c=d.c");
  EXPECT_FALSE(e.robots(0).layout().has_grid());
  EXPECT_EQ(e.robots(0).layout().random().min_gap_mm(), 2);
  ASSERT_EQ(e.robots_size(), 2);
  EXPECT_EQ(e.robots(1).layout().rings().count(1), 6u);
  EXPECT_EQ(e.station().environment(0).hub().radius_mm(), 7);
}

TEST_F(Override, MistakesNameTheArgumentAndTheChoices) {
  const std::pair<std::string, std::string> cases[] = {
      {"arena.widht_mm=3",
       "--set arena.widht_mm=3: unknown field widht_mm in Arena; did you mean width_mm? "
       "Its fields are width_mm, height_mm, circle, polygon"},
      {"arena.depth=3",
       "--set arena.depth=3: unknown field depth in Arena; its fields are width_mm, height_mm, circle, polygon"},
      {"=3",
       "--set =3: unknown field  in Experiment; its fields are name, duration_s, seed, tick_cycles, arena, robots, "
       "motion, "
       "robot_model, physics, radio, station, recording, deployment, movable, obstacle, light, battery, "
       "temperature, "
       "effect, field, run_number, door, tracker, tracking, observable"},
      {"seed", "--set seed: there is no value; write FIELD=VALUE, for instance arena.width_mm=1000"},
      {"seed=x", "--set seed=x: seed cannot be x; it takes a whole number"},
      {"seed=", "--set seed=: seed cannot be empty; it takes a whole number"},
      {"robots.count=-1", "--set robots.count=-1: count cannot be -1; it takes a whole number, 1..100000 robots"},
      {"robots.count=3 ", "--set robots.count=3 : count cannot be 3 ; it takes a whole number, 1..100000 robots"},
      {"arena.width_mm=wide",
       "--set arena.width_mm=wide: width_mm cannot be wide; it takes a number, 40..1000000 mm"},
      {"motion.noise=no", "--set motion.noise=no: noise cannot be no; it takes true or false"},
      {"robots.body=GHOST", "--set robots.body=GHOST: body cannot be GHOST; it takes one of SIMULATED, TRACKED"},
      {"arena=3",
       "--set arena=3: arena is a block and takes no value; set one of its fields: width_mm, height_mm, "
       "circle, polygon"},
      {"seed.x=3", "--set seed.x=3: seed has no fields of its own; write seed=VALUE"},
      {"arena[0].width_mm=3", "--set arena[0].width_mm=3: arena is no list; write it without an index"},
      {"robots[2].count=3",
       "--set robots[2].count=3: robots[2] does not exist; robots has 1 elements, the next to be created is "
       "robots[1]"},
      {"robots[x].count=3", "--set robots[x].count=3: robots[x] is no element of a list; write robots[0]"},
      {"robots[-1].count=3", "--set robots[-1].count=3: robots[-1] is no element of a list; write robots[0]"},
      {"robots[99999999999].count=3",
       "--set robots[99999999999].count=3: robots[99999999999] is no element of a list; write robots[0]"},
      {"robots[0.count=3", "--set robots[0.count=3: robots[0 is no element of a list; write robots[0]"},
  };
  for (const auto& [argument, error] : cases) EXPECT_EQ(override_error(argument), error);
}

TEST_F(Override, LaterErrorsNameTheArgument) {
  const auto error_after = [&](auto change) {
    LoadedExperiment loaded = load("arena { width_mm: 1000 }\nrobots { count: 4 behaviour: 'a.c' }");
    change(loaded);
    return error_of([&] { validate(loaded); });
  };
  const auto set = [](const char* argument) {
    return [=](LoadedExperiment& loaded) { apply_override(loaded, argument); };
  };
  EXPECT_EQ(error_after(set("robots.count=0")),
            "--set robots.count=0: count is 0; it takes a whole number, 1..100000 robots");
  EXPECT_EQ(error_after(set("arena.width_mm=nan")),
            "--set arena.width_mm=nan: width_mm is nan; it takes a number, 40..1000000 mm");
  EXPECT_EQ(error_after(set("arena.height_mm=-5")),
            "--set arena.height_mm=-5: height_mm is -5; it takes a number, 40..1000000 mm");
  EXPECT_EQ(error_after(set("robots[1].body=TRACKED")),
            "--set robots[1].body=TRACKED: count is missing; state count: N, the number of robots");
  EXPECT_EQ(
      error_after([](LoadedExperiment& loaded) { apply_override(loaded, "deployment.hosts=9", "--hosts 9"); }),
      "--hosts 9: hosts is 9, more than there are robots; it takes 1..4");
  EXPECT_EQ(error_after([](LoadedExperiment& loaded) { set_robots(loaded, 0); }),
            "--robots 0: count is 0; it takes a whole number, 1..100000 robots");
  EXPECT_EQ(error_after([](LoadedExperiment& loaded) { set_behaviour(loaded, "/none/b.c"); }),
            "--behaviour /none/b.c: there is no file /none/b.c; name a program, relative to the experiment file");
}

TEST_F(Override, RobotsAndBehaviourOfTheFirstGroup) {
  LoadedExperiment loaded = load("robots { count: 4 behaviour: ['x.c', 'y.c'] }");
  set_robots(loaded, 9);
  set_behaviour(loaded, write("b.c", ""));
  EXPECT_EQ(place_robots(loaded).x_mm.size(), 9u);
  ASSERT_EQ(loaded.experiment.robots(0).behaviour_size(), 1);
  LoadedExperiment rings =
      load("robots { behaviour: 'a.c' layout { rings { count: [1, 6] radius_mm: [0, 60] } } }");
  set_robots(rings, 8);
  EXPECT_EQ(error_of([&] { validate(rings); }),
            "--robots 8: count is 8 but the rings hold 7 robots; write 7 or leave count out");
}

}  // namespace
}  // namespace kilotwin::test
