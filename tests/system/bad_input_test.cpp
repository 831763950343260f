// Bad input gives one clear line on stderr and status 2, and leaves no files.
#include <gtest/gtest.h>

#include <algorithm>

#include "clients/recorder/run_directory.hpp"
#include "core/dds/dds.hpp"
#include "idl/manifest.pb.h"
#include "tests/system/own_domain.hpp"
#include "tests/system/program.hpp"

namespace kilotwin::test {
namespace {

namespace fs = std::filesystem;

class BadInput : public testing::Test {
 protected:
  std::string experiment(const std::string& text) {
    write(scratch / "e.txtpb", text);
    return scratch / "e.txtpb";
  }
  std::string behaviour() const { return "behaviour: \"" + source("behaviours/blink.c") + "\" "; }
  /// The one line on stderr.
  std::string refusal(const Words& words) {
    const Outcome outcome = kilotwin(words, scratch);
    EXPECT_EQ(outcome.status, 2) << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    EXPECT_FALSE(fs::exists(scratch / "runs")) << "left behind";
    return outcome.err;
  }
  std::string refusal_of(const std::string& text) { return refusal({"run", experiment(text), "--mode", "local"}); }
  static void expect_in(const std::string& part, const std::string& line) {
    EXPECT_NE(line.find(part), std::string::npos) << line;
  }
  Scratch scratch;
};

TEST_F(BadInput, InTheExperimentIsReportedWithItsPlace) {
  expect_in("e.txtpb:2:1: ", refusal_of("seed: 1\nsede: 2\n"));
  expect_in("e.txtpb:1:", refusal_of("duration_s: \"long\"\n"));
  expect_in("e.txtpb:1:", refusal_of("robots { count: 0 " + behaviour() + "}\n"));
  expect_in("e.txtpb:1:", refusal_of("duration_s: -1\nrobots { count: 3 " + behaviour() + "}\n"));
  expect_in("e.txtpb:1:", refusal_of("duration_s: nan\nrobots { count: 3 " + behaviour() + "}\n"));
  expect_in("e.txtpb:", refusal_of("robots { count: 4 " + behaviour() + "layout { grid { pitch_mm: 20 } } }\n"));
  expect_in("e.txtpb:", refusal_of("arena { width_mm: 100 height_mm: 100 }\nrobots { count: 50 " + behaviour() +
                                   "layout { grid {} } }\n"));
  expect_in("nothing.c", refusal_of("robots { count: 3 behaviour: \"nothing.c\" }\n"));
  expect_in("partition",
            refusal_of("deployment { partition_columns: 0 }\nrobots { count: 3 " + behaviour() + "}\n"));
  expect_in("nowhere.txtpb", refusal({"run", scratch / "nowhere.txtpb"}));
}

TEST_F(BadInput, InAProgramIsReportedInTheCompilersWords) {
  write(scratch / "broken.c", "#include <kilolib.h>\nvoid setup(void) {\n  int x = y;\n}\n");
  const Outcome outcome =
      kilotwin({"run", experiment("robots { count: 3 behaviour: \"broken.c\" }\n"), "--mode", "local"}, scratch);
  EXPECT_EQ(outcome.status, 2);
  expect_in("broken.c:3:11: error: ", outcome.err);
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  EXPECT_FALSE(fs::exists(scratch / "runs"));
  EXPECT_EQ(kilotwin({"build", scratch / "broken.c"}, scratch).status, 2);
}

TEST_F(BadInput, CheckCompilesEveryProgram) {
  write(scratch / "broken.c", "#include <kilolib.h>\nvoid setup(void) {\n  int x = y;\n}\n");
  const std::string two_groups =
      experiment("robots { count: 3 " + behaviour() +
                 "}\nrobots { count: 3 behaviour: \"broken.c\" layout { grid { pitch_mm: 50 "
                 "} x_mm: 200 } }\n");
  expect_in("broken.c:3:11: error: ", refusal({"check", two_groups}));
  expect_in("broken.c:3:11: error: ", refusal({"sweep", two_groups, "--seeds", "1..2"}));
}

TEST_F(BadInput, WithoutTrajectoriesNamesTheFilesFoundAndExpected) {
  fs::create_directory(scratch / "data");
  const auto of = [&](const std::string& path) { return refusal({"identify", "--train", scratch / path}); };
  expect_in("is an empty directory; expected trajectories.csv", of("data"));
  write(scratch / "data/tracks.csv", "x,y\n1,2\n");
  const std::string other = of("data");
  expect_in("holds tracks.csv with the columns \"x,y\"", other);
  expect_in("run,robot,time_s,x_mm,y_mm", other);
  expect_in("is a file with the columns \"x,y\"; expected a directory", of("data/tracks.csv"));
  expect_in("does not exist", of("nowhere"));
  write(scratch / "data/recording.ktrec", "");
  expect_in("is a run; write its poses", of("data"));
  EXPECT_FALSE(fs::exists(scratch / "identified")) << "left behind";
}

TEST_F(BadInput, InArguments) {
  const std::string good = experiment("robots { count: 3 " + behaviour() + "}\n");
  expect_in("--partitions", refusal({"run", good, "--partitions", "2"}));
  expect_in("--partitions", refusal({"run", good, "--partitions", "0x1"}));
  expect_in("--partitions", refusal({"run", good, "--partitions", "64x64", "--set", "arena.width_mm=500"}));
  expect_in("--set", refusal({"run", good, "--set", "robots.cuont=3"}));
  expect_in("--pace", refusal({"run", good, "--pace", "fast"}));
  expect_in("--duration", refusal({"run", good, "--duration", "-3"}));
  expect_in("--duration", refusal({"run", good, "--duration", "nan"}));
  expect_in("--domain", refusal({"run", good, "--domain", "1000"}));
  expect_in("--help", refusal({"run"}));
  expect_in("no command", refusal({"ruin", good}));
  expect_in("--seed", refusal({"run", good, "--seed", "-1"}));
  expect_in("--seed", refusal({"run", good, "--seed", "18446744073709551616"}));
  expect_in("4099 services", refusal({"run", good, "--partitions", "64x64", "--hosts", "1", "--set",
                                      "arena.width_mm=100000", "--set", "arena.height_mm=100000"}));
}

TEST_F(BadInput, ThatIsNotARecording) {
  write(scratch / "x", "not a recording at all");
  expect_in("not a Kilotwin recording", refusal({"export", scratch / "x", "--trajectories", scratch / "t.csv"}));
  fs::create_directory(scratch / "empty");
  expect_in("empty", refusal({"replay", scratch / "empty", "--verify"}));
  expect_in("empty", refusal({"service", "comm", "--run", scratch / "empty"}));
  expect_in("empty", refusal({"service", "radio", "--run", scratch / "empty"}));
  expect_in("physics, comm (the radio)", kilotwin({"service", "--help"}, scratch).out);
}

TEST_F(BadInput, ADomainInUseByAnotherRun) {
  const dds::DomainClaim claim = dds::DomainClaim::any();
  expect_in("in use", refusal({"run", experiment("robots { count: 3 " + behaviour() + "}\n"), "--domain",
                               std::to_string(claim.domain())}));
}

TEST_F(BadInput, ADomainInUseByServicesStartedByHand) {
  const std::string good = experiment("robots { count: 3 " + behaviour() + "}\n");
  ASSERT_EQ(kilotwin({"run", good, "--prepare", "--out", scratch / "first"}, scratch).status, 0);
  const OwnDomain domain;
  Process other({program(), "service", "comm", "--run", scratch / "first", "--domain", domain.name},
                scratch.path());
  ASSERT_TRUE(other.says("has waited", 30)) << "it is there, and came first";
  const Outcome outcome = kilotwin(
      {"run", good, "--domain", domain.name, "--duration", "100000", "--out", scratch / "second"}, scratch);
  EXPECT_EQ(outcome.status, 2) << outcome.err;
  expect_in("in use by another run", outcome.err);
}

TEST_F(BadInput, APartitionOrShareOutsideTheRun) {
  ASSERT_EQ(kilotwin({"run", experiment("robots { count: 3 " + behaviour() + "}\n"), "--prepare", "--out",
                      scratch / "run"},
                     scratch)
                .status,
            0);
  expect_in("--partition", refusal({"service", "physics", "--run", scratch / "run", "--partition", "1,0"}));
  expect_in("--share", refusal({"service", "behaviours", "--run", scratch / "run", "--share", "2/2"}));
}

TEST_F(BadInput, ADomainForALocalRunIsRefused) {
  expect_in("--domain", refusal({"run", source("experiments/disperse.txtpb"), "--mode", "local", "--domain", "5"}));
}

TEST_F(BadInput, AnAddressThatServicesCannotMeetAtIsRefused) {
  expect_in("--peer: \"fe80::1\" is no IPv4 address",
            refusal({"service", "comm", "--run", scratch / "nowhere", "--peer", "fe80::1"}));
}

TEST_F(BadInput, AServiceOfAnotherBuildIsRefused) {
  ASSERT_EQ(kilotwin({"run", source("experiments/disperse.txtpb"), "--prepare", "--out", scratch / "run"}, scratch)
                .status,
            0);
  const auto directory = recorder::RunDirectory::open(scratch / "run", recorder::RunDirectory::Needs::kManifest);
  proto::Manifest manifest = directory.read_manifest();
  const std::string own = manifest.build();
  EXPECT_NE(kilotwin({"--version"}, scratch).out.find(own), std::string::npos) << own;
  manifest.set_build("0.1.0-other");
  directory.write_manifest(manifest);
  const std::string line = refusal({"service", "comm", "--run", scratch / "run"});
  expect_in("build 0.1.0-other", line);
  expect_in("this is build " + own, line);
}

}  // namespace
}  // namespace kilotwin::test
