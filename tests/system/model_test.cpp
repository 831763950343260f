// Model files: an exported model gives the same run again, effects work across processes, and measurement effects change only
// what the tracker sees.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <sstream>

#include "tests/system/program.hpp"

namespace kilotwin::test {
namespace {

/// Effects with memory, of neighbours, of positions, and on the measurement.
const char* const kModel =
    "effect { name: 'tired' acts_on: WHEEL_GAIN function { of: MOTOR_TIME linear { slope: -0.005 } } }\n"
    "effect { name: 'wander' acts_on: TURN_RATE function { noise { sd: 0.05 correlation_s: 5 } } }\n"
    "effect { name: 'crowd' acts_on: WHEEL_GAIN function { of: DENSITY radius_mm: 90 linear { slope: -0.02 } } }\n"
    "effect { name: 'polish' acts_on: WHEEL_GAIN function { of: PLACE field: 'traffic' exponential { at_infinity: "
    "-0.3 scale: 5 } } }\n"
    "effect { name: 'wind' acts_on: WORLD_DRIFT during: [STOP, STRAIGHT, LEFT, RIGHT] function { constant: 0.3 } "
    "}\n"
    "effect { name: 'shift' acts_on: MEASURED_OFFSET direction_deg: 90 function { constant: 7 } }\n"
    "effect { name: 'mount' acts_on: MEASURED_HEADING function { constant: 0.5 } }\n"
    "field { name: 'traffic' cell_mm: 60 forget_s: 30 }\n";

class Model : public testing::Test {
 protected:
  Words disperse(const Words& more = {}) const {
    Words words{source("experiments/disperse.txtpb"), "--duration", "8", "--robots", "60"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  std::string model() const {
    write(scratch / "effects.txtpb", kModel);
    return scratch / "effects.txtpb";
  }
  Scratch scratch;
};

TEST_F(Model, AnExportedModelGivesTheSameRunAgain) {
  const Words local{"--mode", "local", "--set", "motion.factor_variance_s=0.001", "--model", model()};
  const auto first = run(disperse(local), scratch, "first");
  const Outcome exported = kilotwin({"export", scratch / "first", "--model", scratch / "m.txtpb"}, scratch);
  ASSERT_EQ(exported.status, 0) << exported.err;
  const auto again = run(disperse({"--mode", "local", "--model", scratch / "m.txtpb"}), scratch, "again");
  EXPECT_EQ(again.state_hash, first.state_hash);
  for (const char* field :
       {"wheel_base_mm: 25\n", "noise: true\n", "calibrated_turn_duty: 70\n", "spin_up_s: 0.015\n"})
    EXPECT_NE(read(scratch / "m.txtpb").find(field), std::string::npos) << "a default is stated: " << field;
  // With another seed, an exported model keeps each robot's biases: a second export is the same.
  run(disperse({"--mode", "local", "--seed", "5", "--model", scratch / "m.txtpb"}), scratch, "other");
  ASSERT_EQ(kilotwin({"export", scratch / "other", "--model", scratch / "n.txtpb"}, scratch).status, 0);
  const auto robots = [&](const std::string& file) {
    const std::string text = read(scratch / file);
    return text.substr(text.find("\nrobot {"));
  };
  EXPECT_EQ(robots("n.txtpb"), robots("m.txtpb"));
  EXPECT_NE(run(disperse({"--mode", "local"}), scratch, "plain").state_hash, first.state_hash);
}

TEST_F(Model, EffectsGiveOneHashForEveryDivision) {
  const std::string file = model();
  const auto hash = [&](const Words& words, const std::string& name) {
    return run(disperse(words), scratch, name).state_hash;
  };
  const auto local = hash({"--model", file, "--mode", "local"}, "local");
  EXPECT_EQ(hash({"--model", file, "--mode", "local", "--partitions", "3x2", "--hosts", "2", "--threads", "2"},
                 "threads"),
            local);
  EXPECT_EQ(hash({"--model", file, "--partitions", "2x2", "--hosts", "2"}, "federated"), local);
  // A run on 1x2 partitions continues from a checkpoint of 2x1.
  run({source("experiments/disperse.txtpb"), "--duration", "5", "--robots", "60", "--model", file, "--partitions",
       "2x1", "--checkpoint-every", "4"},
      scratch, "half");
  EXPECT_EQ(
      hash({"--model", file, "--partitions", "1x2", "--mode", "local", "--resume", scratch / "half"}, "resumed"),
      local);
}

TEST_F(Model, MeasuredTrajectoriesAreThoseOfATracker) {
  run(disperse({"--mode", "local", "--model", model()}), scratch, "run");
  for (const bool measured : {false, true}) {
    Words words{"export", scratch / "run", "--trajectories", scratch / (measured ? "m.csv" : "t.csv")};
    if (measured) words.push_back("--measured");
    ASSERT_EQ(kilotwin(words, scratch).status, 0);
  }
  std::istringstream truth(read(scratch / "t.csv")), seen(read(scratch / "m.csv"));
  std::string a, b;
  std::getline(truth, a);
  std::getline(seen, b);
  EXPECT_EQ(a, b);
  int rows = 0;
  for (; std::getline(truth, a) && std::getline(seen, b); ++rows) {
    double t[2], x[2], y[2], heading[2];
    int robot[2];
    ASSERT_EQ(std::sscanf(a.c_str(), "%lf,%d,%lf,%lf,%lf", &t[0], &robot[0], &x[0], &y[0], &heading[0]), 5);
    ASSERT_EQ(std::sscanf(b.c_str(), "%lf,%d,%lf,%lf,%lf", &t[1], &robot[1], &x[1], &y[1], &heading[1]), 5);
    EXPECT_NEAR(x[1], x[0], 1e-9);
    EXPECT_NEAR(y[1], y[0] + 7, 1.1e-4);
    EXPECT_NEAR(std::remainder(heading[1] - heading[0] - 0.5, 2 * 3.14159265358979), 0, 1.1e-6);
  }
  EXPECT_EQ(rows, 60 * 9);
}

}  // namespace
}  // namespace kilotwin::test
