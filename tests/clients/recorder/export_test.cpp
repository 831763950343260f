#include "clients/recorder/export.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <sstream>
#include <utility>

#include "core/base/error.hpp"
#include "core/csv/csv_reader.hpp"
#include "core/os/process.hpp"
#include "tests/clients/recorder/synthetic.hpp"

namespace kilotwin::recorder {
namespace {

std::vector<std::string> lines_of(const std::filesystem::path& file) {
  std::istringstream in(content(file));
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

/// time_s of the rows of robot 0.
std::vector<std::string> times_of(const std::filesystem::path& file) {
  std::vector<std::string> times;
  for (const std::string& line : lines_of(file)) {
    const std::size_t comma = line.find(',');
    if (line.compare(comma, 3, ",0,") == 0) times.push_back(line.substr(0, comma));
  }
  return times;
}

TEST(Export, TrajectoriesByTimeAndRobot) {
  const Scratch scratch;
  write_synthetic(scratch / "r.ktrec", synthetic_header(3), 62);
  Reader reader(scratch / "r.ktrec");
  EXPECT_EQ(export_trajectories(reader, scratch / "t.csv"), 9u);
  EXPECT_EQ(lines_of(scratch / "t.csv"),
            (std::vector<std::string>{
                std::string(kTrajectoryColumns),
                "0,0,0.0000,0.0000,0.000000,0,0,0,0,running,0",
                "0,1,10.0000,-5.0000,0.100000,1,0,0,0,running,0",
                "0,2,20.0000,-10.0000,0.200000,2,0,0,0,failed,1",
                "1.015808,0,15.5000,0.0000,0.000000,0,0,0,0,running,0",  // tick 31 is the first at or after 1 s
                "1.015808,1,25.5000,2.7500,0.100000,1,0,0,0,running,0",
                "1.015808,2,35.5000,5.5000,0.200000,2,0,0,0,failed,1",
                "2.031616,0,31.0000,0.0000,0.000000,0,0,0,0,running,0",
                "2.031616,1,41.0000,10.5000,0.100000,1,0,0,0,running,0",
                "2.031616,2,51.0000,21.0000,0.200000,2,0,0,0,failed,1",
            }));
}

TEST(Export, NumbersAreRoundedAndNeverMinusZero) {
  const Scratch scratch;
  {
    Writer writer(scratch / "r.ktrec", synthetic_header(3));
    const std::vector<double> x{-0.00001, 0.00005, -1234.56785}, y{-0.5, 1e6, 999.99996},
        heading{-3.1415926535, 3.14159265, -1e-9};
    const std::vector<std::uint8_t> led{63, 1 | 2 << 2 | 3 << 4, 0xff}, life(3, 4);
    writer.state({Tick{0}, x, y, heading, led, life});
    writer.end(Tick{0}, 0);
  }
  Reader reader(scratch / "r.ktrec");
  export_trajectories(reader, scratch / "t.csv");
  EXPECT_EQ(
      lines_of(scratch / "t.csv"),
      (std::vector<std::string>{std::string(kTrajectoryColumns), "0,0,0.0000,-0.5000,-3.141593,3,3,3,0,running,0",
                                "0,1,0.0001,1000000.0000,3.141593,1,2,3,0,running,0",
                                "0,2,-1234.5679,1000.0000,0.000000,3,3,3,0,running,0"}));
}

TEST(Export, WantedTimesTakeTheFirstStateAtOrAfter) {
  const Scratch scratch;
  write_synthetic(scratch / "r.ktrec", synthetic_header(1, 0.5), 160);  // states at ticks 0, 16, 31, 46, 62, ...
  Reader reader(scratch / "r.ktrec");
  export_trajectories(reader, scratch / "t.csv", 0.5);
  EXPECT_EQ(times_of(scratch / "t.csv"),
            (std::vector<std::string>{"0", "0.524288", "1.015808", "1.507328", "2.031616", "2.523136", "3.014656",
                                      "3.506176", "4.030464", "4.521984", "5.013504"}));
  reader.rewind();
  export_trajectories(reader, scratch / "t.csv", 2);
  EXPECT_EQ(times_of(scratch / "t.csv"), (std::vector<std::string>{"0", "2.031616", "4.030464"}));
}

TEST(Export, RecordingsOfEveryTickServeAnyInterval) {
  const Scratch scratch;
  write_synthetic(scratch / "r.ktrec", synthetic_header(1, 0.032768), 100);
  Reader reader(scratch / "r.ktrec");
  export_trajectories(reader, scratch / "t.csv", 0.7);
  EXPECT_EQ(times_of(scratch / "t.csv"),
            (std::vector<std::string>{"0", "0.720896", "1.409024", "2.12992", "2.818048"}));
  reader.rewind();
  // Less than a tick: each state once.
  EXPECT_EQ(export_trajectories(reader, scratch / "t.csv", 0.01), 101u);
}

TEST(Export, OtherIntervalsAreRefusedWithTheRecordedOne) {
  const Scratch scratch;
  write_synthetic(scratch / "r.ktrec", synthetic_header(1, 2), 200);
  for (const double every : {1.0, 3.0, 2.5, 0.1}) {
    Reader reader(scratch / "r.ktrec");
    try {
      export_trajectories(reader, scratch / "t.csv", every);
      FAIL() << every;
    } catch (const UserError& error) {
      EXPECT_NE(std::string(error.what()).find("holds a state every 2 s, so take "), std::string::npos)
          << error.what();
    }
    EXPECT_FALSE(std::filesystem::exists(scratch / "t.csv"));
  }
  Reader reader(scratch / "r.ktrec");
  EXPECT_THROW(export_trajectories(reader, scratch / "t.csv", 0), UserError);
  EXPECT_THROW(export_trajectories(reader, scratch / "t.csv", -1), UserError);
  EXPECT_THROW(export_trajectories(reader, scratch / "t.csv", std::nan("")), UserError);
}

TEST(Export, AResumedRunKeepsTheTimesOfTheWholeRun) {
  const Scratch scratch;
  proto::RecordingHeader header = synthetic_header(1);
  header.set_first_tick(40);
  write_synthetic(scratch / "r.ktrec", header, 130);
  Reader reader(scratch / "r.ktrec");
  export_trajectories(reader, scratch / "t.csv");
  EXPECT_EQ(times_of(scratch / "t.csv"), (std::vector<std::string>{"2.031616", "3.014656", "4.030464"}));
}

TEST(Export, ErrorsNameTheFile) {
  const Scratch scratch;
  write_synthetic(scratch / "r.ktrec", synthetic_header(2), 40);
  Reader reader(scratch / "r.ktrec");
  try {
    export_trajectories(reader, scratch / "none/t.csv");
    FAIL();
  } catch (const RunError& error) {
    EXPECT_EQ(error.what(), (scratch / "none/t.csv").string() + ": cannot be created: No such file or directory");
  }
  try {
    export_trajectories(reader, "/dev/full");
    FAIL();
  } catch (const RunError& error) {
    EXPECT_STREQ(error.what(), "/dev/full: cannot be written: No space left on device");
  }
}

TEST(Export, MessagesByReceiverAndSender) {
  const Scratch scratch;
  write_synthetic(scratch / "r.ktrec", synthetic_header(2), 10);
  Reader reader(scratch / "r.ktrec");
  EXPECT_EQ(export_messages(reader, scratch / "m.csv"), 3u);
  EXPECT_EQ(content(scratch / "m.csv"),
            "receiver,sender,count,sent_if_receiver_is_sender\n0,0,9,1\n0,1,4,0\n1,0,7,0\n");
}

TEST(Export, LaterCountsOfAPairReplaceEarlierOnes) {
  const Scratch scratch;
  {
    Writer writer(scratch / "r.ktrec", synthetic_header(3));
    for (const auto& [sender, count] : {std::pair{1u, 5u}, {2u, 6u}, {1u, 8u}}) {
      proto::MessagesRecord messages;
      messages.add_receiver(0);
      messages.add_sender(sender);
      messages.add_count(count);
      writer.messages(messages);
    }
    writer.end(Tick{0}, 0);
  }
  Reader reader(scratch / "r.ktrec");
  export_messages(reader, scratch / "m.csv");
  EXPECT_EQ(content(scratch / "m.csv"), "receiver,sender,count,sent_if_receiver_is_sender\n0,1,8,0\n0,2,6,0\n");
}

TEST(Export, MissingMessageCountsAreAnErrorWithItsRemedy) {
  const Scratch scratch;
  proto::RecordingHeader header = synthetic_header(2);
  header.set_messages(false);
  write_synthetic(scratch / "r.ktrec", header, 10);
  Reader reader(scratch / "r.ktrec");
  try {
    export_messages(reader, scratch / "m.csv");
    FAIL();
  } catch (const UserError& error) {
    EXPECT_EQ(error.what(),
              (scratch / "r.ktrec").string() + ": no message counts; run again with --set recording.messages=true");
  }
}

TEST(Export, GroupsAndStatesAreNamed) {
  const Scratch scratch;
  proto::RecordingHeader header = synthetic_header(3);
  header.add_group_robots(2);
  header.add_group_robots(1);
  {
    Writer writer(scratch / "r.ktrec", header);
    const std::vector<double> zeros(3, 0);
    const std::vector<std::uint8_t> led{0, 3, 12}, life{0, 254, 77};
    writer.state({Tick{0}, zeros, zeros, zeros, led, life});
    writer.end(Tick{0}, 0);
  }
  Reader reader(scratch / "r.ktrec");
  export_trajectories(reader, scratch / "t.csv");
  EXPECT_EQ(lines_of(scratch / "t.csv"),
            (std::vector<std::string>{
                std::string(kTrajectoryColumns), "0,0,0.0000,0.0000,0.000000,0,0,0,0,sleeping,0",
                "0,1,0.0000,0.0000,0.000000,3,0,0,0,flat,0", "0,2,0.0000,0.0000,0.000000,0,3,0,1,77,0"}));
}

/// States at ticks 0 and 31, and a variable that robots 0 and 2 of three have at tick 0, robots 0 and 1 at tick 20.
void write_with_variable(const std::filesystem::path& file, const std::string& name, bool integer) {
  proto::RecordingHeader header = synthetic_header(3);
  proto::VariableColumn& column = *header.add_variable();
  column.set_name(name);
  column.set_every_s(0.5);
  column.set_integer(integer);
  Writer writer(file, header);
  for (const Tick tick : {Tick{0}, Tick{31}}) writer.state(SyntheticState(3, tick).view(tick));
  // As a federated run writes them: after later states, a record per behaviours host.
  for (const auto& [tick, robot] :
       std::initializer_list<std::pair<std::int64_t, std::uint32_t>>{{0, 0}, {0, 2}, {20, 0}, {20, 1}}) {
    proto::VariableRecord record;
    record.set_tick(tick);
    record.set_variable(0);
    record.add_robot(robot);
    if (integer)
      record.add_integer(tick + robot);
    else
      record.add_number(static_cast<double>(tick) + robot + 0.5);
    writer.variable(record);
  }
  for (std::int64_t tick = 0; tick <= 31; ++tick) writer.hash(Tick{tick}, synthetic_hash(tick));
  writer.end(Tick{31}, synthetic_hash(31));
}

TEST(Export, TrajectoriesHaveTheBatterysVoltageAndNoOtherVariable) {
  const Scratch scratch;
  write_with_variable(scratch / "volts.ktrec", "battery_V", false);
  Reader volts(scratch / "volts.ktrec");
  EXPECT_EQ(export_trajectories(volts, scratch / "t.csv"), 6u);
  const std::vector<std::string> lines = lines_of(scratch / "t.csv");
  EXPECT_EQ(lines.at(0), std::string(kTrajectoryColumns) + ",battery_V");
  const char* const ends[] = {",running,0,0.5",  ",running,0,",     ",failed,1,2.5",
                              ",running,0,20.5", ",running,0,21.5", ",failed,1,"};
  for (std::size_t i = 0; i < std::size(ends); ++i) EXPECT_TRUE(lines.at(i + 1).ends_with(ends[i])) << lines[i + 1];
  write_with_variable(scratch / "hops.ktrec", "hops", true);
  Reader hops(scratch / "hops.ktrec");
  export_trajectories(hops, scratch / "t.csv");
  EXPECT_EQ(lines_of(scratch / "t.csv").at(0), kTrajectoryColumns);
}

TEST(Export, PogosimsTableHasTicksAndRecordedVariables) {
  const Scratch scratch;
  write_with_variable(scratch / "hops.ktrec", "hops", true);
  Reader hops(scratch / "hops.ktrec");
  export_pogosim(hops, scratch / "p.csv");
  const std::vector<std::string> lines = lines_of(scratch / "p.csv");
  EXPECT_EQ(lines.at(0), std::string(kPogosimColumns) + ",hops");
  EXPECT_TRUE(lines.at(1).ends_with(",0,0")) << lines[1];
  EXPECT_TRUE(lines.at(2).ends_with(",0,")) << lines[2];
  EXPECT_TRUE(lines.at(4).ends_with(",31,20")) << lines[4];
  EXPECT_TRUE(lines.at(6).ends_with(",31,")) << "robot 2 has no value any more\n" << lines[6];
}

/// An event of each kind at tick 5, and motions of robot 1 with the given duties from there on.
void write_events(const std::filesystem::path& file, const std::vector<std::pair<unsigned, unsigned>>& duties) {
  proto::RecordingHeader header = synthetic_header(3);
  for (const auto kind : {proto::LED, proto::MOTION, proto::STATE, proto::SENT, proto::RECEIVED, proto::STATION})
    header.add_event(kind);
  Writer writer(file, header);
  const auto event = [&](std::int64_t tick, proto::RecordedEvent kind, std::uint32_t value) {
    proto::EventRecord record;
    record.set_tick(tick);
    record.set_kind(kind);
    if (kind != proto::STATION) record.add_robot(1);
    if (kind == proto::LED || kind == proto::MOTION || kind == proto::STATE || kind == proto::STATION)
      record.add_value(value);
    if (kind == proto::SENT || kind == proto::RECEIVED || kind == proto::STATION) record.add_offset_cycles(8);
    if (kind == proto::RECEIVED) {
      record.add_sender(2);
      record.add_distance_mm(40);
    }
    if (kind == proto::STATION) record.add_text("00000000000000000088");
    if (kind == proto::FAILURE) record.add_text("stopped");
    writer.event(record);
  };
  for (const auto kind : {proto::LED, proto::STATE, proto::SENT, proto::RECEIVED, proto::STATION, proto::FAILURE})
    event(5, kind, 4);
  std::int64_t tick = 5;
  for (const auto& [left, right] : duties) event(tick++, proto::MOTION, left | right << 8);
  for (std::int64_t t = 0; t <= tick; ++t) writer.hash(Tick{t}, synthetic_hash(t));
  writer.end(Tick{tick}, synthetic_hash(tick));
}

TEST(Export, EventsOfSomeKindsHaveTheirColumnsAlone) {
  const Scratch scratch;
  write_events(scratch / "r.ktrec", {{70, 0}});
  const auto exported = [&](const std::vector<proto::RecordedEvent>& kinds) {
    Reader reader(scratch / "r.ktrec");
    export_events(reader, scratch / "e.csv", kinds);
    return lines_of(scratch / "e.csv");
  };
  EXPECT_EQ(exported({}).size(), 1u + 7);
  EXPECT_EQ(exported({}).at(0),
            "time_s,event,robot,group,led_r,led_g,led_b,motor_left,motor_right,state,sender,distance_mm,text");
  EXPECT_EQ(exported({proto::STATION}),
            (std::vector<std::string>{"time_s,event,text", "0.163841,station,0x00000000000000000088"}));
  EXPECT_EQ(exported({proto::MOTION}), (std::vector<std::string>{"time_s,event,robot,group,motor_left,motor_right",
                                                                 "0.16384,motion,1,0,70,0"}));
  EXPECT_EQ(exported({proto::RECEIVED}), (std::vector<std::string>{"time_s,event,robot,group,sender,distance_mm",
                                                                   "0.163841,received,1,0,2,40.000"}));
  EXPECT_EQ(exported({proto::LED, proto::FAILURE}),
            (std::vector<std::string>{"time_s,event,robot,group,led_r,led_g,led_b,text", "0.16384,led,1,0,0,1,0,",
                                      "0.16384,failure,1,0,,,,stopped"}));
  EXPECT_EQ(event_kind("received"), proto::RECEIVED);
  EXPECT_FALSE(event_kind("receive"));
  std::string names;
  for (int kind = proto::RecordedEvent_MIN; kind <= proto::RecordedEvent_MAX; ++kind) {
    for (const char* name : {"led", "motion", "state", "sent", "received", "station", "failure"}) {
      if (event_kind(name) == kind) names += (names.empty() ? "" : ", ") + std::string(name);
    }
  }
  EXPECT_EQ(names, kEventKinds);
  write_synthetic(scratch / "none.ktrec", synthetic_header(1), 3);
  Reader none(scratch / "none.ktrec");
  EXPECT_EQ(export_events(none, scratch / "e.csv", {proto::FAILURE}), 0u);
  none.rewind();
  EXPECT_THROW(export_events(none, scratch / "e.csv", {proto::LED}), UserError);
}

TEST(Export, CommandsCountOtherDutiesThanTheCalibratedOnes) {
  const Scratch scratch;
  const std::vector<CalibratedDuties> calibrated(3, {60, 61, 70, 71});
  const auto exported = [&](const std::vector<std::pair<unsigned, unsigned>>& duties) {
    std::filesystem::remove(scratch / "r.ktrec");
    write_events(scratch / "r.ktrec", duties);
    Reader reader(scratch / "r.ktrec");
    return export_commands(reader, scratch / "c.csv", calibrated);
  };
  EXPECT_EQ(exported({{0, 0}, {70, 71}, {60, 0}, {0, 61}}).other.changes, 0u);
  const ExportedCommands commands = exported({{70, 71}, {70, 200}, {60, 0}, {59, 0}});
  EXPECT_EQ(commands.rows, 2u) << "straight, then left";
  EXPECT_EQ(commands.other.changes, 2u);
  EXPECT_EQ(commands.other.robots, 1u);
  EXPECT_EQ(commands.other.robot, 1u);
  EXPECT_EQ(commands.other.left, 70u);
  EXPECT_EQ(commands.other.right, 200u);
  EXPECT_DOUBLE_EQ(commands.other.time_s, 6 * 0.032768);
  Reader reader(scratch / "r.ktrec");
  EXPECT_EQ(export_commands(reader, scratch / "c.csv").other.changes, 0u) << "nobody knows the calibration";
}

TEST(Export, PogosimsTableHasItsColumnsAndItsOrigin) {
  const Scratch scratch;
  proto::RecordingHeader header = synthetic_header(2);
  const auto exported = [&](const std::string& recording) {
    {
      Writer writer(scratch / recording, header);
      const std::vector<double> x{-1000, 250}, y{500, 0}, heading{1.5, -3};
      const std::vector<std::uint8_t> led(2, 0), life(2, 0);
      writer.state({Tick{0}, x, y, heading, led, life});
      writer.end(Tick{0}, 0);
    }
    Reader reader(scratch / recording);
    export_pogosim(reader, scratch / "p.csv");
    return lines_of(scratch / "p.csv");
  };
  EXPECT_EQ(exported("one.ktrec"),
            (std::vector<std::string>{std::string(kPogosimColumns), "0,robots,0,0.0000,1000.0000,1.500000,0",
                                      "0,robots,1,1250.0000,500.0000,-3.000000,0"}));
  header.add_group_robots(1);
  header.add_group_robots(1);
  EXPECT_EQ(exported("two.ktrec").at(2), "0,robots-1,1,1250.0000,500.0000,-3.000000,0");
}

TEST(Export, PogosimsFeatherFileIsReadByArrow) {
  const Scratch scratch;
  write_synthetic(scratch / "r.ktrec", synthetic_header(2), 31);
  Reader reader(scratch / "r.ktrec");
  export_pogosim(reader, scratch / "p.csv");
  reader.rewind();
  export_pogosim(reader, scratch / "p.feather");
  const std::filesystem::path node = os::find_executable("node");
  if (node.empty()) GTEST_SKIP() << "node is not installed";
  const os::ProcessResult result =
      os::run_process({node, KILOTWIN_SOURCES "/tests/clients/recorder/pogosim_test.mjs", scratch / "p.feather",
                       scratch / "p.csv", KILOTWIN_SOURCES "/build/npm"});
  if (result.end.code == 77) GTEST_SKIP() << "build/npm has no apache-arrow; scripts/setup installs it";
  EXPECT_TRUE(result.end.well()) << result.errors;
}

TEST(Export, TablesWhoseNameEndsInGzAreGzipped) {
  const Scratch scratch;
  write_synthetic(scratch / "r.ktrec", synthetic_header(50), 400);
  Reader reader(scratch / "r.ktrec");
  export_trajectories(reader, scratch / "t.csv");
  reader.rewind();
  export_trajectories(reader, scratch / "t.csv.gz");
  EXPECT_TRUE(content(scratch / "t.csv.gz").starts_with("\x1f\x8b"));
  CsvReader plain(scratch / "t.csv"), packed(scratch / "t.csv.gz");
  ASSERT_EQ(plain.columns(), packed.columns());
  std::size_t rows = 0;
  for (; plain.next(); ++rows) {
    ASSERT_TRUE(packed.next());
    for (std::size_t i = 0; i < plain.cells(); ++i) ASSERT_EQ(plain.text(i), packed.text(i));
  }
  EXPECT_FALSE(packed.next());
  EXPECT_GT(rows, 500u);
}

}  // namespace
}  // namespace kilotwin::recorder
