// A run continues from its checkpoint on another number of partitions and hosts, with the same result.
#include <gtest/gtest.h>

#include "tests/system/program.hpp"

namespace kilotwin::test {
namespace {

class Checkpoints : public testing::Test {
 protected:
  Words experiment(const Words& more) const {
    Words words{source("experiments/disperse.txtpb"), "--duration", "12"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  Scratch scratch;
};

TEST_F(Checkpoints, SavedOn2x2AreResumedOn1x1InEitherMode) {
  const auto whole = run(experiment({"--mode", "local"}), scratch, "whole");
  const auto saving =
      run(experiment({"--partitions", "2x2", "--hosts", "2", "--checkpoint-every", "5"}), scratch, "saving");
  EXPECT_EQ(saving.state_hash, whole.state_hash) << "saving does not change the result";

  const auto local =
      run(experiment({"--mode", "local", "--partitions", "1x1", "--resume", scratch / "saving"}), scratch, "local");
  EXPECT_EQ(local.state_hash, whole.state_hash);
  EXPECT_GT(local.resumed_from_tick, 0);
  EXPECT_EQ(local.messages.sent, whole.messages.sent);
  const auto federated = run(experiment({"--partitions", "3x1", "--hosts", "3", "--resume", scratch / "saving"}),
                             scratch, "federated");
  EXPECT_EQ(federated.state_hash, whole.state_hash);
}

TEST_F(Checkpoints, OfALocalRunAreResumedFederated) {
  const auto whole = run(experiment({"--mode", "local", "--checkpoint-every", "4"}), scratch, "whole");
  const auto resumed = run(experiment({"--partitions", "2x1", "--resume", scratch / "whole"}), scratch, "resumed");
  EXPECT_EQ(resumed.state_hash, whole.state_hash);
}

TEST_F(Checkpoints, HoldTheHashChainAlsoWhenTheStationLagsBehind) {
  // A run of one robot does thousands of ticks a second, so the station gets the hash of a checkpoint's tick long after the tick.
  const Words words{source("experiments/disperse.txtpb"), "--robots", "1", "--partitions", "1x1"};
  const auto with = [&](const Words& more) {
    Words all = words;
    all.insert(all.end(), more.begin(), more.end());
    return all;
  };
  const auto whole = run(with({"--duration", "120", "--mode", "local"}), scratch, "whole");
  run(with({"--duration", "110", "--checkpoint-every", "9"}), scratch, "saving");
  int resumed = 0;
  for (const auto& checkpoint : std::filesystem::directory_iterator(scratch / "saving/checkpoints")) {
    const std::string name = "resumed-" + std::to_string(++resumed);
    EXPECT_EQ(
        run(with({"--duration", "120", "--mode", "local", "--resume", checkpoint.path().string()}), scratch, name)
            .state_hash,
        whole.state_hash)
        << checkpoint.path();
  }
  EXPECT_EQ(resumed, 12);
}

TEST_F(Checkpoints, BeyondTheEndAreRefused) {
  run(experiment({"--mode", "local", "--checkpoint-every", "5"}), scratch, "saved");
  const Outcome outcome = kilotwin({"run", source("experiments/disperse.txtpb"), "--duration", "2", "--mode",
                                    "local", "--resume", scratch / "saved"},
                                   scratch);
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("--duration"), std::string::npos) << outcome.err;
}

TEST_F(Checkpoints, HoldTheStacksOfProgramsThatBlock) {
  const Words blocking{"--behaviour", source("behaviours/delay_walk.c")};
  const auto with = [&](Words more) {
    more.insert(more.end(), blocking.begin(), blocking.end());
    return experiment(more);
  };
  const auto whole = run(with({"--mode", "local", "--checkpoint-every", "5"}), scratch, "whole");
  const auto resumed =
      run(with({"--mode", "local", "--partitions", "2x2", "--hosts", "3", "--resume", scratch / "whole"}), scratch,
          "resumed");
  EXPECT_EQ(resumed.state_hash, whole.state_hash);
}

TEST_F(Checkpoints, OfAnotherExperimentAreRefused) {
  run(experiment({"--mode", "local", "--checkpoint-every", "5"}), scratch, "saved");
  Words words = experiment({"--mode", "local", "--seed", "2", "--resume", scratch / "saved"});
  words.insert(words.begin(), "run");
  const Outcome outcome = kilotwin(words, scratch);
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("another experiment"), std::string::npos) << outcome.err;
}

TEST_F(Checkpoints, OfARunWithoutAnyAreRefused) {
  run(experiment({"--mode", "local"}), scratch, "none");
  Words words = experiment({"--mode", "local", "--resume", scratch / "none"});
  words.insert(words.begin(), "run");
  const Outcome outcome = kilotwin(words, scratch);
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("--checkpoint-every"), std::string::npos) << outcome.err;
}

TEST_F(Checkpoints, ResumedRunsReplay) {
  run(experiment({"--mode", "local", "--checkpoint-every", "5"}), scratch, "saved");
  run(experiment({"--mode", "local", "--resume", scratch / "saved"}), scratch, "resumed");
  EXPECT_EQ(kilotwin({"replay", scratch / "resumed", "--verify"}, scratch).status, 0);
}

}  // namespace
}  // namespace kilotwin::test
