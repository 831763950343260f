// The days that fit, choose and report; the model that is written; and the notes about reported days.
#include "clients/identify/kilogrid/floor_protocol.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>

#include "clients/identify/kilogrid/identify_floor.hpp"
#include "core/base/error.hpp"
#include "tests/clients/identify/kilogrid/plain_floor.hpp"

namespace kilotwin::kilogrid {
namespace {

FloorRun day(int number) {
  FloorRun run{"day-" + std::to_string(number), 100, {}, {}};
  FloorTrack& track = run.tracks.emplace_back();
  for (int k = 0; k < 3; ++k) {
    track.time_s.push_back(k);
    track.x_mm.push_back(25.0 + number);
    track.y_mm.push_back(75);
  }
  return run;
}
std::vector<FloorRun> days(int from, int to) {
  std::vector<FloorRun> all;
  for (int d = from; d < to; ++d) all.push_back(day(d));
  return all;
}
std::vector<std::string> names(const std::vector<FloorRun>& runs) {
  std::vector<std::string> all;
  for (const FloorRun& run : runs) all.push_back(run.name);
  return all;
}
using Names = std::vector<std::string>;

/// A file that is removed with the object.
struct Scratch {
  std::filesystem::path path = std::filesystem::path(testing::TempDir()) / ("opened-" + std::to_string(getpid()));
  Scratch() { std::filesystem::remove(path); }
  ~Scratch() { std::filesystem::remove(path); }
};

TEST(FloorProtocol, ATestSetReportsAndTrainingDaysChoose) {
  const FloorDays d = divided(days(0, 5), days(5, 8));
  EXPECT_EQ(names(d.fit), (Names{"day-0", "day-1", "day-3", "day-4"}));
  EXPECT_EQ(names(d.choose), Names{"day-2"});
  EXPECT_EQ(names(d.report), (Names{"day-5", "day-6", "day-7"}));
  EXPECT_FALSE(d.chose_on_reported);
}

TEST(FloorProtocol, OfOneSetSomeDaysReportAndOthersChoose) {
  const FloorDays d = divided(days(0, 6), {});
  EXPECT_EQ(names(d.fit), (Names{"day-0", "day-2", "day-3", "day-5"}));
  EXPECT_EQ(names(d.report), Names{"day-1"});
  EXPECT_EQ(names(d.choose), Names{"day-4"});
}

TEST(FloorProtocol, TooFewDaysChooseAndReportAtOnce) {
  for (const FloorDays& d : {divided(days(0, 3), {}), divided(days(0, 2), days(2, 3))}) {
    EXPECT_EQ(names(d.fit).size(), 2U);
    EXPECT_TRUE(d.chose_on_reported);
    EXPECT_EQ(names(d.choose), names(d.report));
  }
  EXPECT_THROW(static_cast<void>(divided(days(0, 1), {})), UserError);
}

TEST(FloorProtocol, AModelThatPredictsWorseThanTheBaseIsNotChosen) {
  const auto worse = [](double mean_mm2) { return Excess{mean_mm2, 50}; };
  EXPECT_EQ(chosen_model({{100, 80}, {120, 79, worse(-159)}, {140, 78, worse(-316)}}), 0U) << "larger misfits";
  EXPECT_EQ(chosen_model({{100, 80}, {60, 79, worse(-159)}, {140, 78, worse(-316)}}), 1U)
      << "the last effect does harm";
  EXPECT_EQ(chosen_model({{100, 80}, {60, 79, worse(-159)}, {59.5, 78, worse(-316)}}), 1U)
      << "the smaller of two that are alike";
  EXPECT_EQ(chosen_model({{100, 80}, {60, 95, worse(2625)}}), 0U) << "cells are predicted worse";
  EXPECT_EQ(chosen_model({{100, 80}, {60, 82, {324, 200}}}), 1U) << "by 2.5 %, but within chance";
  EXPECT_EQ(chosen_model({{100, 80}, {60, 82, {324, 50}}}), 0U) << "by 2.5 %, beyond chance";
  EXPECT_EQ(chosen_model({{100, 80}, {60, 85, {825, 5000}}}), 0U) << "by 6 %, whatever the standard error";
  EXPECT_EQ(chosen_model({{100, 80}, {60, 80.4, {64, 5}}}), 1U) << "beyond chance, but by 0.5 %";
  EXPECT_EQ(chosen_model({{100, 80}, {std::nan(""), 70, worse(-1500)}}), 0U);
  EXPECT_EQ(chosen_model({{100, 80}, {60, std::nan(""), {std::nan(""), 5}}}), 0U);
  EXPECT_EQ(chosen_model({{100, 80}, {60, 79, worse(-159)}, {40, 78, worse(-316)}}), 2U);
}

TEST(FloorProtocol, TheExcessOfAnErrorIsOfPairedRobots) {
  // Robots differ much, the models little: 1 mm^2 more for each row of each robot.
  Validation base, model;
  for (const double each_mm2 : {10.0, 400.0, 9000.0}) {
    for (Validation* v : {&base, &model}) {
      const double rows = 20, sum = rows * (each_mm2 + (v == &model ? 1 : 0));
      v->sum += sum;
      v->rows += 20;
      v->by_robot.emplace_back(sum, rows);
    }
  }
  EXPECT_NEAR(excess_of(model, base).mean_mm2, 1, 1e-9);
  EXPECT_NEAR(excess_of(model, base).se_mm2, 0, 1e-9);
  // One robot of three alone has it.
  base.by_robot[2].first += 20, base.by_robot[1].first += 20, base.sum += 40;
  const Excess one = excess_of(model, base);
  EXPECT_NEAR(one.mean_mm2, 1.0 / 3, 1e-9);
  EXPECT_NEAR(one.se_mm2, std::sqrt((4.0 / 9 + 1.0 / 9 + 1.0 / 9) * 3 / 2) / 3, 1e-9);
  base.by_robot.pop_back();
  EXPECT_EQ(excess_of(model, base).mean_mm2, INFINITY) << "other robots";
}

/// Days of a search, as open() takes them.
struct Days {
  explicit Days(std::vector<FloorRun> runs) : runs_(std::move(runs)) {}
  operator std::vector<const FloorRun*>() const {  // NOLINT: an argument
    std::vector<const FloorRun*> all;
    for (const FloorRun& run : runs_) all.push_back(&run);
    return all;
  }

 private:
  std::vector<FloorRun> runs_;
};

TEST(OpenedDays, CountsOtherSearchesOfTheSameDays) {
  const Scratch scratch;
  const OpenedDays ledger(scratch.path);
  const std::vector<FloorRun> report = days(5, 7);
  EXPECT_EQ(ledger.open(report, Days(days(0, 3)), "", "2026-01-01").before, 0U);
  EXPECT_EQ(ledger.open(report, Days(days(0, 3)), "", "2026-01-02").before, 0U)
      << "the same search gives the same result";
  EXPECT_EQ(ledger.open(report, Days(days(0, 4)), "", "2026-01-03").before, 1U);
  EXPECT_EQ(ledger.open(days(6, 7), Days(days(1, 4)), "", "2026-01-04").before, 2U) << "one of the days was open";
  EXPECT_EQ(ledger.open(days(6, 7), Days(days(1, 4)), "no effects", "2026-01-04").before, 3U) << "other options";
  EXPECT_EQ(ledger.open(days(7, 9), Days(days(0, 3)), "", "2026-01-05").before, 0U) << "other days";
  EXPECT_EQ(OpenedDays({}).open(report, Days(days(0, 2)), "", "2026-01-06").before, 0U);
}

TEST(OpenedDays, KeepsWhatItDoesNotUnderstand) {
  const Scratch scratch;
  std::ofstream(scratch.path) << "# a remark\nnonsense\n";
  EXPECT_EQ(OpenedDays(scratch.path).open(days(5, 6), Days(days(0, 3)), "", "2026-01-01").before, 0U);
  std::ifstream in(scratch.path);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  EXPECT_TRUE(text.starts_with("# a remark\nnonsense\n2026-01-01 ")) << text;
}

TEST(OpenedDays, KeepsALastLineWithoutAnEnd) {
  const Scratch scratch;
  std::ofstream(scratch.path) << "# a remark";
  const OpenedDays record(scratch.path);
  EXPECT_EQ(record.open(days(5, 6), Days(days(0, 3)), "", "2026-01-01").before, 0U);
  EXPECT_EQ(record.open(days(5, 6), Days(days(0, 4)), "", "2026-01-02").before, 1U);
}

TEST(OpenedDays, NeverReplacesAFileThatItCannotRead) {
  const Scratch scratch;
  std::filesystem::create_directory(scratch.path);
  const OpenedDays::Opened opened = OpenedDays(scratch.path).open(days(5, 6), Days(days(0, 3)), "", "2026-01-01");
  EXPECT_NE(opened.unwritable.find("cannot be read"), std::string::npos) << opened.unwritable;
  EXPECT_TRUE(std::filesystem::is_directory(scratch.path));
}

TEST(OpenedDays, SayWhyTheyCannotBeNoted) {
  const OpenedDays::Opened opened =
      OpenedDays("/nonexistent/opened-days.txt").open(days(5, 6), Days(days(0, 3)), "", "2026-01-01");
  EXPECT_NE(opened.unwritable.find("/nonexistent"), std::string::npos) << opened.unwritable;
}

TEST(IdentifyFloor, SaysWhichDaysChoseAndThatDaysWereOpenedBefore) {
  const Scratch scratch;
  const auto played = [](std::uint64_t from, std::uint64_t to) {
    std::vector<FloorRun> runs;
    for (std::uint64_t seed = from; seed < to; ++seed) {
      runs.push_back(test::play(test::Truth::kNothing, 12, 300, seed));
      runs.back().name = "day-" + std::to_string(seed);
    }
    return runs;
  };
  identify::Options options;
  options.find_effects = false;
  static_cast<void>(OpenedDays(scratch.path).open(played(4, 5), Days(days(0, 2)), "", "2026-01-01"));
  const identify::Identified found =
      identify::identified_by(*floor_study(played(1, 4), played(4, 5), options, scratch.path), options);
  const identification::Result& result = found.found.result();
  EXPECT_EQ(result.held_out().in_words(), "Days that give the errors: day-4. Days that chose the model: day-3.");
  EXPECT_EQ(result.held_out().opened_before(), 1U);
  EXPECT_NE(result.check().in_words().find("1 other search was reported on them before"), std::string::npos)
      << result.check().in_words();
  EXPECT_NE(found.found.verdict().find(result.check().in_words()), std::string::npos) << "the page says it";
  EXPECT_EQ(result.check().path_size(), 1);
  EXPECT_EQ(result.before().misfit() > 0, true);
}

}  // namespace
}  // namespace kilotwin::kilogrid
