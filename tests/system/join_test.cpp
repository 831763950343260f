// A program of another project joins a run: the example of the documentation, in C, with idl/public.idl alone.
#include <gtest/gtest.h>

#include <csignal>
#include <fstream>

#include "core/dds/dds.hpp"
#include "tests/system/own_domain.hpp"
#include "tests/system/program.hpp"

namespace kilotwin::test {
namespace {

namespace fs = std::filesystem;

class Join : public testing::Test {
 protected:
  /// The example with the configuration that `kilotwin config` prints.
  Words example() const {
    const Outcome config = kilotwin({"config"}, scratch);
    EXPECT_EQ(config.status, 0) << config.err;
    return {"/usr/bin/env", "CYCLONEDDS_URI=" + config.out, KILOTWIN_JOIN_EXAMPLE, domain.name};
  }
  Scratch scratch;
  const OwnDomain domain;
};

TEST_F(Join, TheExampleFindsARunAndStopsIt) {
  Process run({program(), "run", source("experiments/disperse.txtpb"), "--robots", "9", "--partitions", "1x1",
               "--duration", "3600", "--pace", "1", "--domain", domain.name, "--out", scratch / "run"},
              scratch.path());
  Process joined(example(), scratch.path());
  const Outcome outcome = joined.wait();
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("disperse is at tick"), std::string::npos) << outcome.out;
  const Outcome stopped = run.wait();
  EXPECT_EQ(stopped.status, 0) << stopped.err;
  EXPECT_LT(recorder::read_summary(scratch / "run/summary.json").simulated_s, 3600);
}

TEST_F(Join, TheExampleSaysThatItFindsNoRun) {
  Process joined(example(), scratch.path());
  EXPECT_TRUE(joined.says("no run found on domain", 30)) << "it waits 3 s";
  EXPECT_TRUE(joined.running()) << "a run may start later";
}

TEST_F(Join, AnotherMachineIsAPeerOfTheConfiguration) {
  const Outcome config = kilotwin({"config", "--peer", "192.0.2.7", "--peer", "192.0.2.8"}, scratch);
  EXPECT_EQ(config.status, 0) << config.err;
  EXPECT_NE(config.out.find("<Peer Address=\"192.0.2.7\"/><Peer Address=\"192.0.2.8\"/>"), std::string::npos)
      << config.out;
  EXPECT_EQ(config.out.find("\"lo\""), std::string::npos) << config.out;
}

TEST_F(Join, ThePageShowsTheExampleAsItIsTested) {
  const std::string example = read(source("tests/interop/join_example.c"));
  ASSERT_FALSE(example.empty());
  for (const auto& entry : fs::recursive_directory_iterator(source("docs"))) {
    if (entry.path().extension() == ".md" && read(entry.path()).find("\n" + example + "```") != std::string::npos)
      return;
  }
  ADD_FAILURE() << "no page of docs/ shows tests/interop/join_example.c as it is";
}

}  // namespace
}  // namespace kilotwin::test
