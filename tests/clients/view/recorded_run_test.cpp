// Recordings by their index: every state is found, whatever grows, is cut off or damaged.
#include "clients/view/recorded_run.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "clients/recorder/observables.hpp"
#include "clients/view/flights.hpp"
#include "clients/view/light_picture.hpp"
#include "clients/view/live_observables.hpp"
#include "clients/view/robot_log.hpp"
#include "clients/view/watched_plan.hpp"
#include "core/base/error.hpp"
#include "core/plan/tracking_settings.hpp"
#include "idl/experiment.pb.h"
#include "tests/clients/view/recordings.hpp"
#include "tests/system/program.hpp"

namespace kilotwin::view {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using recorder::StateIndex;
using test::Scratch;

double tick_of(const std::string& frame) {
  double tick = -1;
  std::memcpy(&tick, frame.data() + 8, sizeof tick);
  return tick;
}

TEST(StateIndex, FindsTheStatesThatTheReaderReads) {
  Scratch scratch;
  test::write_circling(scratch / "r.ktrec", {.robots = 30, .states = 200, .floors = true});
  StateIndex index(scratch / "r.ktrec");
  EXPECT_TRUE(index.update());
  EXPECT_FALSE(index.update()) << "nothing new";
  EXPECT_TRUE(index.ended());
  EXPECT_EQ(index.floors().size(), 2u);
  recorder::Reader sequential(scratch / "r.ktrec"), random(scratch / "r.ktrec");
  std::size_t number = 0;
  while (const proto::StateRecord* state = sequential.next_state()) {
    ASSERT_LT(number, index.states().size());
    EXPECT_EQ(index.states()[number].tick, state->tick());
    ++number;
  }
  EXPECT_EQ(number, index.states().size());
  // Backwards, so that no state follows the one before.
  for (std::size_t i = number; i-- > 0;) {
    random.go_to(index.states()[i].offset);
    const proto::Record* const record = random.next();
    ASSERT_TRUE(record != nullptr && record->has_state());
    EXPECT_EQ(record->state().tick(), index.states()[i].tick);
    EXPECT_EQ(index.at_or_before(index.states()[i].tick), i);
    if (i > 0) {
      EXPECT_EQ(index.at_or_before(index.states()[i].tick - 1), i - 1);
    }
  }
  EXPECT_EQ(index.at_or_before(-5), 0u);
  EXPECT_EQ(index.at_or_before(1 << 30), number - 1);
}

TEST(StateIndex, StopsAtEveryCutAndGoesOnWhenTheFileGrows) {
  Scratch scratch;
  test::write_circling(scratch / "whole.ktrec", {.robots = 3, .states = 12});
  const std::string whole = test::read(scratch / "whole.ktrec");
  StateIndex all(scratch / "whole.ktrec");
  all.update();
  test::write(scratch / "r.ktrec", "");
  StateIndex growing(scratch / "r.ktrec");
  std::ofstream out(scratch / "r.ktrec", std::ios::binary);
  std::size_t known = 0;
  for (std::size_t at = 0; at < whole.size(); at += 17) {
    out.write(whole.data() + at, static_cast<std::streamsize>(std::min<std::size_t>(17, whole.size() - at)));
    out.flush();
    growing.update();
    ASSERT_GE(growing.states().size(), known);
    known = growing.states().size();
  }
  EXPECT_EQ(known, all.states().size());
  EXPECT_TRUE(growing.ended());
}

TEST(StateIndex, SurvivesDamageAnywhere) {
  Scratch scratch;
  test::write_circling(scratch / "whole.ktrec", {.robots = 3, .states = 12});
  const std::string whole = test::read(scratch / "whole.ktrec");
  for (std::size_t at = 0; at < whole.size(); at += 17) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x55);
    test::write(scratch / "r.ktrec", damaged);
    StateIndex index(scratch / "r.ktrec");
    index.update();
    ASSERT_LE(index.states().size(), 12u);
    try {
      RecordedRun run(scratch / "r.ktrec");
      for (const std::int64_t tick : {0, 60, 100000}) {
        const std::string frame = run.frame_at(tick, 1);
        EXPECT_TRUE(frame.empty() || frame.size() == kFrameHeader_bytes + 3 * kFrameRobot_bytes);
      }
      static_cast<void>(run.trail(2, 100));
    } catch (const UserError&) {
      // The header, or the first state, is damaged.
    }
  }
}

TEST(RecordedRun, GivesTheStateAtAnyTime) {
  Scratch scratch;
  test::write_circling(scratch / "r.ktrec", {.robots = 20, .states = 50});
  RecordedRun run(scratch / "r.ktrec");
  const json text = json::parse(run.text());
  EXPECT_EQ(text["source"], "recorded");
  EXPECT_EQ(text["states"], 50);
  EXPECT_EQ(text["robots"], 20);
  const auto last = text["lastTick"].get<std::int64_t>();
  for (std::int64_t tick = last + 3; tick >= 0; tick -= 7) {
    const std::string frame = run.frame_at(tick, 4);
    const double at = tick_of(frame);
    EXPECT_LE(at, static_cast<double>(tick));
    double next = 0;
    std::memcpy(&next, frame.data() + 16, sizeof next);
    EXPECT_TRUE(next > static_cast<double>(tick) || next == at) << tick;
    // The pose, to the grid.
    std::uint16_t x = 0;
    std::memcpy(&x, frame.data() + kFrameHeader_bytes + 2 * 5, sizeof x);
    const double wanted = test::circling_pose(5, 20, at * text["tickSeconds"].get<double>()).x_mm;
    EXPECT_NEAR(text["gridLowest"].get<double>() + text["gridStep"].get<double>() * x, wanted, 0.02);
  }
}

TEST(RecordedRun, TellsOfRobotsAndTheirTrails) {
  Scratch scratch;
  test::write_circling(scratch / "r.ktrec", {.robots = 20, .states = 2000, .every_s = 0.1});
  RecordedRun run(scratch / "r.ktrec");
  const json robot = json::parse(run.robot(1, 1000))["run"];
  EXPECT_EQ(robot["attempted"], 6);
  EXPECT_EQ(robot["heard"][0]["robot"], 0);
  EXPECT_EQ(robot["heard"][0]["count"], 9);
  EXPECT_EQ(robot["heard"].size(), 2u);
  EXPECT_EQ(robot["heardBy"][0]["robot"], 0);
  EXPECT_EQ(json::parse(run.robot(20, 0))["type"], "notice");
  const json trail = json::parse(run.trail(3, 1000));
  EXPECT_LE(trail["xy"].size(), 2 * kMostPoints + 2);
  EXPECT_GT(trail["xy"].size(), 200u);
  const Pose end = test::circling_pose(3, 20, 1000 * 0.032768);
  EXPECT_NEAR(trail["xy"][trail["xy"].size() - 2].get<double>(), end.x_mm, 1);
  EXPECT_EQ(json::parse(run.trail(20, 0))["type"], "notice");
  EXPECT_NE(run.steer({}), "");
}

/// The number of a plot in the list.
std::uint32_t number_of(RecordedRun& run, const std::string& name) {
  const json list = json::parse(run.plots())["plots"];
  for (std::size_t i = 0; i < list.size(); ++i)
    if (list[i]["name"] == name) return static_cast<std::uint32_t>(i);
  ADD_FAILURE() << name;
  return 0;
}

/// The whole plot, in as many answers as that takes.
json whole_plot(RecordedRun& run, std::uint32_t number, std::optional<std::uint32_t> robot = std::nullopt) {
  for (int answers = 0; answers < 10000; ++answers) {
    json plot = json::parse(run.plot(number, robot));
    if (plot["whole"].get<bool>()) return plot;
  }
  ADD_FAILURE() << "no end";
  return {};
}

TEST(RecordedCurves, AreTheObservablesOfTheStates) {
  Scratch scratch;
  test::write_circling(scratch / "r.ktrec", {.robots = 20, .states = 50});
  recorder::Reader reader(scratch / "r.ktrec");
  const recorder::ObservableCurves expected = recorder::observe(reader);
  RecordedRun run(scratch / "r.ktrec");
  for (const auto& info : {recorder::Observable::kMsd, recorder::Observable::kNearest}) {
    const std::string name(recorder::kObservables[static_cast<std::size_t>(info)].name);
    const json plot = whole_plot(run, number_of(run, name));
    ASSERT_EQ(plot["time"].size(), expected.time_s.size());
    for (std::size_t i = 0; i < expected.time_s.size(); ++i) {
      EXPECT_NEAR(plot["time"][i].get<double>(), expected.time_s[i], 1e-3);
      const double value = expected.of(info)[i];
      EXPECT_NEAR(plot["values"][0][i].get<double>(), value, 1e-5 * std::abs(value)) << name;
    }
  }
  const json lit = whole_plot(run, number_of(run, "lit"));
  EXPECT_EQ(lit["values"][0][0], 19) << "the LED of robot 0 is off at first";
  const json robot = whole_plot(run, number_of(run, "displacement"), 7);
  const Pose first = test::circling_pose(7, 20, 0), last = test::circling_pose(7, 20, robot["time"].back());
  EXPECT_NEAR(robot["values"][0].back().get<double>(), std::hypot(last.x_mm - first.x_mm, last.y_mm - first.y_mm),
              0.01);
  EXPECT_EQ(run.plot(number_of(run, "msd"), 7), "") << "of the swarm alone";
  EXPECT_EQ(run.plot(number_of(run, "displacement"), 20), "") << "no such robot";
  EXPECT_EQ(run.plot(1000, std::nullopt), "");
}

TEST(RecordedCurves, ShowVariablesAndCountEvents) {
  Scratch scratch;
  constexpr std::uint32_t kRobots = 6;
  constexpr int kStates = 30;
  test::write_circling(scratch / "r.ktrec", {.robots = kRobots, .states = kStates, .inside = true});
  RecordedRun run(scratch / "r.ktrec");
  const json swarm = json::parse(run.plot(number_of(run, "count"), std::nullopt));
  ASSERT_EQ(swarm["time"].size(), std::size_t{kStates});
  EXPECT_EQ(swarm["names"], (json{"mean", "min", "max"}));
  const json of_robot = json::parse(run.plot(number_of(run, "count"), 4));
  const json part = json::parse(run.plot(number_of(run, "part"), 4)),
             none = json::parse(run.plot(number_of(run, "part"), 3));
  for (int i = 0; i < kStates; ++i) {
    const auto at = static_cast<std::size_t>(i);
    EXPECT_EQ(swarm["values"][0][at], 3 * i - 5) << "the mean of -2 r over 6 robots is -5";
    EXPECT_EQ(swarm["values"][1][at], 3 * i - 10);
    EXPECT_EQ(swarm["values"][2][at], 3 * i);
    EXPECT_EQ(of_robot["values"][0][at], test::circling_count(4, i));
    EXPECT_EQ(part["values"][0][at], 0.5 * static_cast<double>(test::circling_count(4, i)));
    EXPECT_TRUE(none["values"][0][at].is_null());
  }
  // Robots 1, 3 and 5 have sent once per state.
  EXPECT_EQ(json::parse(run.plot(number_of(run, "sent"), std::nullopt))["values"][0].back(), 3 * kStates);
  EXPECT_EQ(json::parse(run.plot(number_of(run, "sent"), 3))["values"][0].back(), kStates);
  EXPECT_EQ(json::parse(run.plot(number_of(run, "sent"), 2))["values"][0].back(), 0);

  // The value at a time is the last one up to it.
  const json text = json::parse(run.text());
  const auto last = text["lastTick"].get<std::int64_t>();
  for (std::int64_t tick = 0; tick <= last; tick += 5) {
    const json program = json::parse(run.program(4, tick));
    EXPECT_EQ(program["variables"][0]["name"], "count");
    const auto number = static_cast<int>(std::floor(static_cast<double>(tick) / (0.5 / 0.032768)));
    EXPECT_LE(std::abs(program["variables"][0]["value"].get<std::int64_t>() - test::circling_count(4, number)), 3)
        << tick;
  }
  EXPECT_TRUE(json::parse(run.program(3, last))["variables"][1]["value"].is_null());
  EXPECT_EQ(json::parse(run.program(kRobots, 0))["type"], "notice");
}

TEST(RecordedCurves, OfLongRunsHaveABoundedNumberOfPoints) {
  Scratch scratch;
  test::write_circling(scratch / "r.ktrec", {.robots = 4, .states = 5000, .every_s = 0.1, .inside = true});
  RecordedRun run(scratch / "r.ktrec");
  for (const char* name : {"msd", "count"}) {
    const json plot = whole_plot(run, number_of(run, name));
    EXPECT_LE(plot["time"].size(), kMostPoints + 1) << name;
    EXPECT_GT(plot["time"].size(), kMostPoints / 2) << name;
  }
  // Events are counted over several answers; what has come so far stays.
  json sent;
  int answers = 0;
  do {
    sent = json::parse(run.plot(number_of(run, "sent"), std::nullopt));
    ++answers;
  } while (!sent["whole"].get<bool>() && answers < 100);
  EXPECT_GT(answers, 1);
  EXPECT_EQ(sent["values"][0].back(), 2 * 5000);
  EXPECT_LE(sent["time"].size(), kMostPoints + 2);
}

TEST(RecordedCurves, GrowWithTheRecording) {
  Scratch scratch;
  test::write_circling(scratch / "whole.ktrec", {.robots = 5, .states = 40, .inside = true});
  const std::string whole = test::read(scratch / "whole.ktrec");
  test::write(scratch / "r.ktrec", whole.substr(0, whole.size() / 2));
  RecordedRun run(scratch / "r.ktrec");
  const std::uint32_t count = number_of(run, "count"), sent = number_of(run, "sent");
  const json before = json::parse(run.plot(count, std::nullopt));
  static_cast<void>(run.plot(sent, std::nullopt));
  test::write(scratch / "r.ktrec", whole);
  ASSERT_NE(run.grown(), "");
  RecordedRun fresh(scratch / "r.ktrec");
  EXPECT_LT(before["time"].size(), 40u);
  // An answer holds for a second, so another robot is asked for.
  EXPECT_EQ(run.plot(count, 2), fresh.plot(count, 2));
  EXPECT_EQ(run.plot(sent, 1), fresh.plot(sent, 1));
}

TEST(RecordedCurves, AreTheObservablesOfTheExperiment) {
  Scratch scratch;
  test::write_circling(scratch / "r.ktrec", {.robots = 20, .states = 60, .inside = true, .observables = true});
  recorder::Reader reader(scratch / "r.ktrec");
  const recorder::ObservableCurves expected = recorder::observe(reader);
  ASSERT_EQ(expected.own.size(), 2u);
  RecordedRun run(scratch / "r.ktrec");
  for (const recorder::OwnCurve& own : expected.own) {
    const json plot = whole_plot(run, number_of(run, own.name));
    ASSERT_EQ(plot["time"].size(), expected.time_s.size()) << own.name;
    for (std::size_t i = 0; i < own.value.size(); ++i)
      EXPECT_NEAR(plot["values"][0][i].get<double>(), own.value[i], 1e-5 * std::abs(own.value[i])) << own.name << i;
  }
  EXPECT_EQ(run.plot(number_of(run, "far"), 3), "") << "of the swarm alone";
}

TEST(RecordedCurves, ObservablesGrowWithTheRecordingAndEndAsThoseOfTheWhole) {
  Scratch scratch;
  test::write_circling(scratch / "whole.ktrec", {.robots = 5, .states = 400, .inside = true, .observables = true});
  const std::string whole = test::read(scratch / "whole.ktrec");
  test::write(scratch / "r.ktrec", whole.substr(0, whole.size() / 2));
  RecordedRun run(scratch / "r.ktrec");
  const std::uint32_t most = number_of(run, "most");
  const json before = whole_plot(run, most);
  EXPECT_GT(before["time"].size(), 50u);
  test::write(scratch / "r.ktrec", whole);
  ASSERT_NE(run.grown(), "");
  RecordedRun fresh(scratch / "r.ktrec");
  const json expected = whole_plot(fresh, most);
  EXPECT_EQ(expected["time"].size(), 400u);
  // The answers before the end were right; an answer holds for a second.
  for (std::size_t i = 0; i < before["time"].size(); ++i)
    ASSERT_EQ(before["values"][0][i], expected["values"][0][i]) << i;
  ASSERT_TRUE(test::eventually([&] { return whole_plot(run, most)["values"] == expected["values"]; }));
}

TEST(RecordedRun, TellsWhichMessagesFly) {
  Scratch scratch;
  test::write_circling(scratch / "r.ktrec", {.robots = 40, .states = 20, .flights = true});
  RecordedRun run(scratch / "r.ktrec");
  const json text = json::parse(run.text());
  EXPECT_EQ(text["receivedRecorded"], true);
  EXPECT_EQ(text["sentRecorded"], false);
  const auto last = text["lastTick"].get<std::int64_t>();
  const json all = json::parse(run.flights(-1, last));
  EXPECT_EQ(all["tick"].size(), 19u * 4);
  EXPECT_EQ(all["whole"], true);
  for (std::size_t i = 0; i < all["tick"].size(); ++i)
    EXPECT_EQ(all["sender"][i].get<int>(), all["receiver"][i].get<int>() + 1);
  // Every message is in one of the parts of a divided time.
  std::size_t parts = 0;
  for (std::int64_t from = -1; from < last; from += 7)
    parts += json::parse(run.flights(from, std::min(last, from + 7)))["tick"].size();
  EXPECT_EQ(parts, 19u * 4);
  EXPECT_TRUE(json::parse(run.flights(last, last))["tick"].empty());
  test::write_circling(scratch / "many.ktrec", {.robots = 20000, .states = 3, .flights = true});
  RecordedRun many(scratch / "many.ktrec");
  const json bounded = json::parse(many.flights(-1, 1000));
  EXPECT_EQ(bounded["tick"].size(), kMostFlights);
  EXPECT_EQ(bounded["whole"], false);
}

TEST(RecordedRun, ShowsWhatWasSentWhereMuchIsReceived) {
  Scratch scratch;
  test::write_circling(scratch / "r.ktrec",
                       {.robots = 6000, .states = 400, .every_s = 0.05, .flights = true, .inside = true});
  RecordedRun run(scratch / "r.ktrec");
  const json flights = json::parse(run.flights(-1, 400));
  EXPECT_EQ(flights["tick"].size(), kMostFlights);
  EXPECT_EQ(flights["whole"], false);
  std::size_t sent = 0;
  for (std::size_t i = 0; i < flights["tick"].size(); ++i) sent += flights["sender"][i] == flights["receiver"][i];
  EXPECT_EQ(sent, kMostFlights / 2);
}

TEST(RecordedRun, CountsMessagesUpToTheTick) {
  Scratch scratch;
  test::write_circling(scratch / "r.ktrec", {.robots = 40, .states = 60, .flights = true, .inside = true});
  RecordedRun run(scratch / "r.ktrec");
  // Before each state but the first, robot 10 receives a message of robot 11, and robot 11 sends at each state.
  const recorder::RecordingSchedule schedule(TickLength{262144}, 0.5);
  for (const int number : {0, 1, 30, 59, 12}) {
    const std::int64_t tick = schedule.tick(number).count();
    const json receiver = json::parse(run.robot(10, tick)), sender = json::parse(run.robot(11, tick));
    EXPECT_EQ(receiver["whole"], true);
    EXPECT_EQ(receiver["received"], number);
    EXPECT_EQ(receiver["sent"], 0);
    EXPECT_EQ(receiver["heard"].empty(), number == 0);
    EXPECT_EQ(receiver["lately"], number == 0 ? json::array() : json{11});
    EXPECT_EQ(sender["sent"], number + 1);
    EXPECT_EQ(sender["received"], 0);
    if (number > 0) {
      EXPECT_EQ(receiver["heard"][0]["count"], number);
    }
  }
}

/// How bright a cell of the picture is: its alpha, 0 to 190.
int brightness(const json& light, std::uint32_t column, std::uint32_t row) {
  const std::string text = light["floor"]["rgba"];
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  const std::size_t octet = 4 * (kLightCells * row + column) + 3, group = 4 * (octet / 3);
  std::uint32_t bits = 0;
  for (std::size_t k = 0; k < 4; ++k)
    bits = bits << 6 | static_cast<std::uint32_t>(kDigits.find(text[group + k]) & 63);
  return static_cast<int>(bits >> (16 - 8 * (octet % 3)) & 255);
}

TEST(LightPicture, HasLampsWhereTheyAreAndShadowsOfRobots) {
  proto::Experiment experiment;
  experiment.set_duration_s(100);
  experiment.mutable_arena()->set_width_mm(640);
  experiment.mutable_arena()->set_height_mm(640);
  experiment.add_robots()->set_count(1);
  EXPECT_EQ(LightPicture(plan_of(experiment)).text(0, {}, {}), "") << "no light";
  proto::LightSource& lamp = *experiment.mutable_light()->add_source();
  lamp.set_height_mm(30);
  lamp.set_intensity(2);
  experiment.mutable_light()->mutable_sensor()->set_cosine(false);  // the lamp shines along the floor
  lamp.mutable_circle()->set_radius_mm(200);
  lamp.mutable_circle()->set_period_s(40);
  lamp.add_switch_s(30);
  experiment.mutable_light()->set_shadows(true);
  LightPicture picture(plan_of(experiment));
  const auto at = [&picture](double time_s, double robot_y_mm) {
    const std::array x{100.0}, y{robot_y_mm};
    return json::parse(picture.text(TickLength{262144}.at_or_after(time_s).count(), x, y));
  };
  const json first = at(0, 300), shaded = at(0, 5), later = at(10, 300), off = at(31, 300);
  EXPECT_NEAR(first["lamps"][0]["x"], 200, 1e-6);
  EXPECT_NEAR(later["lamps"][0]["y"], 200, 1) << "it circles";
  EXPECT_EQ(later["lamps"][0]["on"], true);
  EXPECT_EQ(off["lamps"][0]["on"], false);
  EXPECT_GT(brightness(first, 52, 31), 2 * brightness(first, 12, 31));
  EXPECT_GT(brightness(later, 31, 12), 2 * brightness(later, 31, 52)) << "up is the first row";
  EXPECT_GT(brightness(first, 36, 31), 0);
  EXPECT_EQ(brightness(shaded, 36, 31), 0) << "behind the robot";
  EXPECT_EQ(brightness(off, 52, 31), 0);
}

TEST(RecordedRun, ATrailIsCutWhereTheRobotWasPlacedElsewhere) {
  Scratch scratch;
  test::write_circling(scratch / "r.ktrec", {.robots = 20, .states = 120, .jumps = true});
  RecordedRun run(scratch / "r.ktrec");
  const auto cuts = [&run](std::uint32_t robot, std::int64_t tick) {
    const json trail = json::parse(run.trail(robot, tick));
    EXPECT_EQ(trail["whole"], true);
    return std::count(trail["xy"].begin(), trail["xy"].end(), json(nullptr));
  };
  EXPECT_EQ(cuts(3, 100000), 0);
  EXPECT_EQ(cuts(4, 100000), 2) << "x and y";
  EXPECT_EQ(cuts(4, 500), 0) << "before it";
}

TEST(RecordedCurves, TwoViewersOfDifferentRobotsBothGetTheirCurves) {
  Scratch scratch;
  // So large that one answer does not suffice: 18 states of 2.6 MB each.
  test::write_circling(scratch / "r.ktrec", {.robots = 100000, .states = 18});
  RecordedRun run(scratch / "r.ktrec");
  const std::uint32_t msd = number_of(run, "displacement");
  std::map<std::uint32_t, int> answers;
  for (std::set<std::uint32_t> waiting{1, 2, 3}; !waiting.empty();) {
    for (const std::uint32_t robot : std::set(waiting)) {
      ASSERT_LE(++answers[robot], 18) << "an answer reads a state at least";
      if (json::parse(run.plot(msd, robot))["whole"].get<bool>()) waiting.erase(robot);
    }
  }
}

TEST(RecordedRun, MarksWhatWasPlacedElsewhere) {
  Scratch scratch;
  test::write_circling(scratch / "r.ktrec", {.robots = 20, .states = 120, .outside = true, .placed = true});
  RecordedRun run(scratch / "r.ktrec");
  const json marks = json::parse(run.marks());
  ASSERT_EQ(marks["marks"].size(), 1u) << "packets are none";
  EXPECT_EQ(marks["whole"], true);
  EXPECT_EQ(marks["marks"][0]["tick"], 1526);
  EXPECT_EQ(marks["marks"][0]["text"], "robot 4 placed at 120, -80 mm, heading 90\u00b0");
  EXPECT_EQ(json::parse(run.marks()), marks);
}

TEST(RecordedRun, TellsWhatTrackersSawAndWhichPacketsCame) {
  Scratch scratch;
  test::write_circling(scratch / "r.ktrec", {.robots = 20, .states = 200, .outside = true});
  RecordedRun run(scratch / "r.ktrec");
  const auto last = json::parse(run.text())["lastTick"].get<std::int64_t>();
  for (const std::int64_t tick : {std::int64_t{0}, last / 2, last}) {
    const json outside = json::parse(run.outside(tick));
    ASSERT_EQ(outside["robots"], (json{0, 1, 2, 3, 4, 5, 6, 7, 8})) << "the tracker has lost robot 9";
    const Pose pose = test::circling_pose(8, 20, static_cast<double>(tick) * 0.032768);
    EXPECT_NEAR(outside["places"][40].get<double>(), pose.x_mm, 12) << "of at most half a second before";
    EXPECT_EQ(outside["places"][42], 850);
    EXPECT_EQ(outside["places"][43], 750);
    const auto packets = outside["packets"];
    const int sent = static_cast<int>(static_cast<double>(tick) * 0.032768 / 5 + 1e-6) + 1;
    EXPECT_EQ(packets.size(), static_cast<std::size_t>(std::min<int>(sent, kMostPackets)));
    EXPECT_EQ(packets.back()["command"], 6);
    char octets[24];
    std::snprintf(octets, sizeof octets, "%02x%016d07", sent - 1, 0);
    EXPECT_EQ(packets.back()["message"], octets);
  }
}

TEST(ResidualCurves, FollowTheTableOfTheMonitor) {
  Scratch scratch;
  fs::create_directories(scratch / "run");
  test::write_circling(scratch / "run/recording.ktrec", {.robots = 20, .states = 5});
  const std::string header = "time_s,robot,samples,headings,tested,along,across,heading,mean_square\n";
  // Robot 3 has 4 samples per second, robot 5 has 12 without headings.
  std::ofstream table(scratch / "run/residuals.csv");
  table << header << "1,3,4,4,4,1,-2,0.5,1\n1,5,12,0,0,1,1,,2\n2,3,4,4,4,3,0,0.5,1\n2,5,12,0" << std::flush;
  RecordedRun run(scratch / "run");
  const std::uint32_t residuals = number_of(run, "residuals");
  const json robot = whole_plot(run, residuals, 3);
  EXPECT_EQ(robot["names"], (json{"along", "across", "heading"}));
  EXPECT_EQ(robot["time"], (json{1, 2}));
  EXPECT_EQ(robot["values"], (json{{1, 3}, {-2, 0}, {0.5, 0.5}}));
  const json swarm = whole_plot(run, residuals);
  EXPECT_NEAR(swarm["values"][0][0].get<double>(), (12 * 1 + 24 * 2) / 36.0, 1e-5);
  EXPECT_EQ(swarm["values"][0][1], 1) << "the row that is being written does not count";
  table << ",12,5,5,,6\n3,5,12,0,12,0,0,,6\n" << std::flush;
  ResidualCurves grown(scratch / "run");
  const Curves whole = grown.curves(5, kMostPoints);
  EXPECT_EQ(whole.values[0], (std::vector<double>{1, 5, 0}));
  EXPECT_TRUE(std::isnan(whole.values[2][0]));
  // Of fewer points, each stays standard normal: sums over the root of their number. Seconds 1; 2 and 3.
  const Curves fewer = grown.curves(5, 2);
  ASSERT_EQ(fewer.time_s, (std::vector<double>{1, 3}));
  EXPECT_NEAR(fewer.values[0][1], 5 / std::sqrt(2.0), 1e-12);
  EXPECT_FALSE(ResidualCurves(scratch / "none").any());
}

TEST(LiveObservables, AreOfPosesAndSayWhatTheyLack) {
  proto::Experiment experiment;
  experiment.add_robots()->set_count(2);
  for (const auto& [name, value] : {std::pair{"wide", "mean(abs(x_mm))"},
                                    {"hops", "max(hop_count) + msd"},
                                    {"moved", "max(displacement_mm)"},
                                    {"red", "share(led == red)"}}) {
    proto::Observable& observable = *experiment.add_observable();
    observable.set_name(name);
    observable.set_value(value);
  }
  LiveObservables live(experiment, 2);
  const json plots = json::parse(live.list())["plots"];
  ASSERT_EQ(plots.size(), 4u);
  EXPECT_EQ(plots[0]["absent"], "");
  EXPECT_NE(plots[1]["absent"].get<std::string>().find("uses hop_count, which is in the run's recording only"),
            std::string::npos);
  EXPECT_EQ(plots[2]["title"], "moved (observable, motion since opening)");
  SwarmView swarm(2, 0, 0);
  LiveObservables::Clock::time_point now{};
  for (int i = 0; i < 3000; ++i, now += std::chrono::hours(1)) {
    swarm.x_mm = {-1.0 * i, 3.0 * i};
    swarm.led = {static_cast<std::uint8_t>(i % 2 == 0 ? 3 : 0), 0};
    live.take(i, swarm, now);
    live.take(i + 0.5, swarm, now);  // too soon after the other
  }
  EXPECT_EQ(live.plot(1), "");
  EXPECT_EQ(live.plot(4), "");
  const json wide = json::parse(live.plot(0)), moved = json::parse(live.plot(2)), red = json::parse(live.plot(3));
  EXPECT_LE(wide["time"].size(), kMostPoints);
  EXPECT_GT(wide["time"].size(), kMostPoints / 2);
  for (std::size_t i = 0; i < wide["time"].size(); ++i) {
    const double at = wide["time"][i];
    EXPECT_EQ(at, std::floor(at));
    EXPECT_EQ(wide["values"][0][i], 2 * at);
    EXPECT_EQ(moved["values"][0][i], 3 * at);
    EXPECT_EQ(red["values"][0][i], std::fmod(at, 2) == 0 ? 0.5 : 0);
  }
}

TEST(Alarms, AreThoseUpToTheTime) {
  Scratch scratch;
  test::write(scratch / "alarms.txt",
              "monitor: 71.4 s: robot 2 leaves the model\nmonitor: 75.2 s: tracker \"a\"\nsomething else\n");
  EXPECT_TRUE(alarms_until(scratch / "alarms.txt", 71).empty());
  EXPECT_EQ(alarms_until(scratch / "alarms.txt", 72),
            (std::vector<std::string>{"71.4 s: robot 2 leaves the model"}));
  EXPECT_EQ(alarms_until(scratch / "alarms.txt", 100).size(), 2u);
  EXPECT_TRUE(alarms_until(scratch / "none.txt", 100).empty());
}

TEST(TrackedPlaces, TurnWithTheirTracker) {
  proto::Experiment experiment;
  proto::Tracker& tracker = *experiment.add_tracker();
  tracker.set_source("ceiling");
  tracker.set_x_mm(100);
  tracker.set_heading_deg(90);
  tracker.set_scale(2);
  TrackerSample sample;
  sample.robot = {3};
  sample.state = {0};
  sample.x = {10};
  sample.y = {0};
  sample.heading_rad = {0};
  sample.xx = {25};
  sample.xy = {0};
  sample.yy = {1};
  sample.heading_variance_rad2 = {1};
  sample.led = {0};
  std::map<std::uint32_t, TrackedPlace> places;
  experiment.set_duration_s(10);
  const auto plan = plan_of(experiment);
  ASSERT_TRUE(plan);
  add_places(plan->tracking_settings().trackers, sample, places);
  ASSERT_EQ(places.size(), 1u);
  EXPECT_NEAR(places[3].x_mm, 100, 1e-9);
  EXPECT_NEAR(places[3].y_mm, 20, 1e-9);
  EXPECT_NEAR(places[3].xx_mm2, 4, 1e-9);
  EXPECT_NEAR(places[3].yy_mm2, 100, 1e-9);
  EXPECT_FALSE(message_of("00"));
  EXPECT_FALSE(message_of("zz000000000000000000"));
  EXPECT_EQ((*message_of("0a0000000000000000ff"))[9], 255);
}

TEST(RobotLog, EndsAtTheTimeWithWholeLines) {
  Scratch scratch;
  std::string text;
  for (int i = 0; i < 2000; ++i)
    text += std::to_string(i / 10) + "." + std::to_string(i % 10) + "00 line " + std::to_string(i) + "\n";
  test::write(scratch / "log.txt", text);
  EXPECT_EQ(log_until(scratch / "log.txt", -1), "");
  EXPECT_EQ(log_until(scratch / "log.txt", 0.1), "0.000 line 0\n0.100 line 1\n");
  const std::string end = log_until(scratch / "log.txt", 1e9);
  EXPECT_LE(end.size(), kMostLog_bytes);
  EXPECT_GT(end.size(), kMostLog_bytes / 2);
  EXPECT_TRUE(text.ends_with(end));
  EXPECT_EQ(text[text.size() - end.size() - 1], '\n') << "a whole line comes first";
  test::write(scratch / "log.txt", "0.5 no end");
  EXPECT_EQ(log_until(scratch / "log.txt", 1), "0.5 no end");
  EXPECT_EQ(log_until(scratch / "none.txt", 1), "");
}

TEST(RecordedRun, ChangesTheFloorWithTime) {
  Scratch scratch;
  test::write_circling(scratch / "r.ktrec", {.robots = 2, .states = 40, .floors = true});
  RecordedRun run(scratch / "r.ktrec");
  EXPECT_EQ(run.floors_version(0), 1u);
  EXPECT_EQ(run.floors_version(100000), 2u);
  const json first = json::parse(run.floors_at(0)), last = json::parse(run.floors_at(100000));
  EXPECT_EQ(first["floors"].size(), 1u);
  EXPECT_EQ(last["floors"].size(), 1u);
  EXPECT_NE(first["floors"][0]["rgba"], last["floors"][0]["rgba"]);
}

TEST(RecordedRun, RefusesWhatIsNoRun) {
  Scratch scratch;
  EXPECT_THROW(RecordedRun(scratch / "nowhere"), UserError);
  test::write(scratch / "r.ktrec", "something else");
  EXPECT_THROW(RecordedRun(scratch / "r.ktrec"), UserError);
  test::write_circling(scratch / "whole.ktrec", {.robots = 3, .states = 1});
  test::write(scratch / "begun.ktrec", test::read(scratch / "whole.ktrec").substr(0, 100));
  EXPECT_THROW(RecordedRun(scratch / "begun.ktrec"), UserError);
}

}  // namespace
}  // namespace kilotwin::view
