// Curves of report.html where the recording is long; who held up whom.
#include "clients/cli/run_report.hpp"

#include <gtest/gtest.h>

#include "clients/recorder/summary.hpp"
#include "tests/system/program.hpp"

namespace kilotwin::cli {
namespace {

TEST(RunReport, SaysWhatIsDrawnOfALongRecordingAndWhoHeldUpWhom) {
  const test::Scratch scratch;
  test::write(
      scratch / "e.txtpb",
      "duration_s: 8\nrobots { count: 9 behaviour: \"" + test::source("behaviours/disperse.c") +
          "\" layout { grid { pitch_mm: 40 } } }\nobservable { name: \"wide\" value: \"mean(abs(x_mm))\" }\n");
  const test::Outcome outcome =
      test::kilotwin({"run", scratch / "e.txtpb", "--mode", "local", "--quiet", "--out", scratch / "run"}, scratch);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto directory = recorder::RunDirectory::open(scratch / "run", recorder::RunDirectory::Needs::kRecording);
  // 9 states, 0 s to 8 s, of 9 robots: one state in 3.
  write_run_report(directory, 30);
  const std::string some = test::read(directory.report());
  EXPECT_NE(some.find("the curves are of one state in 3."), std::string::npos);
  for (const char* curve : {"wide, an observable of the experiment", "Mean square displacement", "class=\"plot\""})
    EXPECT_NE(some.find(curve), std::string::npos) << curve;
  write_run_report(directory);
  const std::string all = test::read(directory.report());
  EXPECT_EQ(all.find("one state in"), std::string::npos);
  EXPECT_NE(all, some);

  // The federate that waited least held up the others, unless all waited most of their time.
  recorder::Summary summary = recorder::read_summary(directory.summary());
  summary.federates = {{"physics 1,1", 1, 0, 9}, {"radio", 8, 1, 1}};
  recorder::write_summary(summary, directory.summary());
  write_run_report(directory);
  EXPECT_NE(test::read(directory.report()).find("radio held up the others: it waited for 10 % of its time."),
            std::string::npos);
  summary.federates = {{"physics 1,1", 1, 0, 9}, {"radio", 2, 1, 7}};
  recorder::write_summary(summary, directory.summary());
  write_run_report(directory);
  EXPECT_NE(test::read(directory.report()).find("Nobody held up the run"), std::string::npos);
}

}  // namespace
}  // namespace kilotwin::cli
