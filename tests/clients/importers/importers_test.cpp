#include <gtest/gtest.h>

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "clients/importers/imported.hpp"
#include "clients/importers/pogosim_table.hpp"
#include "clients/importers/tracker_log.hpp"
#include "clients/recorder/table.hpp"
#include "core/base/error.hpp"

namespace kilotwin::importers {
namespace {

constexpr const char* kGather = R"(<argos-configuration>
  <framework><system threads="4"/><experiment length="60" ticks_per_second="31" random_seed="7"/></framework>
  <controllers>
    <kilobot_controller id="walker" library="l">
      <actuators>
        <differential_steering implementation="default" bias_avg="0.000015" bias_stddev="0.00186"/>
        <kilobot_communication implementation="default"/>
      </actuators>
      <sensors><kilobot_communication implementation="default" medium="ir" noise_std_dev="5"/></sensors>
      <params behavior="build/behaviors/disperse"/>
    </kilobot_controller>
  </controllers>
  <arena size="1.2,1.2,1" center="0,0,0.5">
    <box id="north" size="1,0.01,0.1" movable="false"><body position="0,0.505,0" orientation="0,0,0"/></box>
    <box id="south" size="1,0.01,0.1" movable="false"><body position="0,-0.505,0" orientation="0,0,0"/></box>
    <box id="east" size="0.01,1,0.1" movable="false"><body position="0.505,0,0" orientation="0,0,0"/></box>
    <box id="west" size="0.01,1,0.1" movable="false"><body position="-0.505,0,0" orientation="0,0,0"/></box>
    <box id="load" size="0.1,0.1,0.03" movable="true" mass="0.018"><body position="0.3,0,0" orientation="90,0,0"/></box>
    <cylinder id="post" radius="0.04" height="0.05" movable="false"><body position="-0.3,0.1,0"/></cylinder>
    <light id="lamp" position="0,0,1" intensity="1"/>
    <distribute>
      <position method="uniform" min="-0.2,-0.1,0" max="0.2,0.3,0"/>
      <orientation method="uniform" min="0,0,0" max="360,0,0"/>
      <entity quantity="20"><kilobot id="kb" communication_range="0.1"><controller config="walker"/></kilobot></entity>
    </distribute>
    <kilobot id="kb_20" communication_range="0.1"><body position="-0.4,0.4,0" orientation="90,0,0"/><controller config="walker"/></kilobot>
    <kilobot id="kb_21" colour="red"><body position="0.4,-0.4,0" orientation="0,0,0"/><controller config="walker"/></kilobot>
  </arena>
  <physics_engines><dynamics2d id="plane"/></physics_engines>
  <media><kilobot_communication id="ir" message_drop_prob="0.25"/></media>
  <warp factor="9"/>
</argos-configuration>
)";

bool notes(const Imported& imported, const std::string& words) {
  return std::any_of(imported.notes.begin(), imported.notes.end(),
                     [&](const std::string& note) { return note.find(words) != std::string::npos; });
}

TEST(ArgosImport, TakesOverElementsWithACounterpart) {
  const Imported imported = from_argos(kGather, "gather.argos");
  const proto::Experiment& e = imported.experiment;
  EXPECT_EQ(e.duration_s(), 60);
  EXPECT_EQ(e.seed(), 7u);
  // The space within the four walls, which are no obstacles.
  EXPECT_NEAR(e.arena().width_mm(), 1000, 1e-6);
  EXPECT_NEAR(e.arena().height_mm(), 1000, 1e-6);
  ASSERT_EQ(e.obstacle_size(), 1);
  EXPECT_DOUBLE_EQ(e.obstacle(0).cylinder().radius_mm(), 40);
  EXPECT_DOUBLE_EQ(e.obstacle(0).x_mm(), -300);
  ASSERT_EQ(e.movable_size(), 1);
  EXPECT_DOUBLE_EQ(e.movable(0).mass_g(), 18);
  EXPECT_DOUBLE_EQ(e.movable(0).heading_deg(), 90);
  EXPECT_NEAR(e.motion().bias_mean_mm_s(), 0.015, 1e-9);
  EXPECT_NEAR(e.motion().bias_sd_mm_s(), 1.86, 1e-9);
  EXPECT_NEAR(e.radio().propagation().reading_sd_db(), 5 * 0.139, 1e-9);
  EXPECT_DOUBLE_EQ(e.radio().range_mm(), 100);
  EXPECT_DOUBLE_EQ(e.radio().loss(), 0.25);
  EXPECT_DOUBLE_EQ(e.light().source(0).intensity(), std::round(1024 * std::exp(-2.0)));
}

TEST(ArgosImport, PlacesRobotsByTheirDiscs) {
  const Imported imported = from_argos(kGather, "gather.argos");
  ASSERT_EQ(imported.experiment.robots_size(), 2);
  const proto::RobotGroup &drawn = imported.experiment.robots(0), &stated = imported.experiment.robots(1);
  EXPECT_EQ(drawn.count(), 20u);
  EXPECT_EQ(drawn.behaviour(0), "disperse.c");
  EXPECT_DOUBLE_EQ(drawn.layout().random().width_mm(), 400);
  EXPECT_NEAR(drawn.layout().y_mm(), 100, 1e-9);
  EXPECT_EQ(stated.first_uid(), 20u);
  ASSERT_EQ(imported.poses.size(), 1u);
  EXPECT_EQ(stated.layout().poses().csv(), imported.poses[0].name);
  // The disc's centre is 9.2 mm ahead of the point between the rear legs.
  EXPECT_EQ(imported.poses[0].text, "x_mm,y_mm,heading_deg\n-400.000,409.200,90\n409.200,-400.000,0\n");
}

TEST(ArgosImport, NamesTheLinesThatWereNotTakenOver) {
  const Imported imported = from_argos(kGather, "gather.argos");
  EXPECT_TRUE(notes(imported, "2: <system>: threads=\"4\": give --threads"));
  EXPECT_TRUE(notes(imported, "27: <kilobot>: colour=\"red\" has no counterpart"));
  EXPECT_TRUE(notes(imported, "31: <warp>: has no counterpart"));
  EXPECT_TRUE(notes(imported, "10: <params>: names a compiled program"));
  EXPECT_FALSE(notes(imported, "library"));
  const std::string text = experiment_text(imported, "gather.argos");
  EXPECT_EQ(text.rfind("# Made of gather.argos by kilotwin import.\n", 0), 0u);
  EXPECT_NE(text.find("#   31: <warp>"), std::string::npos);
}

std::string error_of(const std::string& text) {
  try {
    (void)from_argos(text, "f.argos");
  } catch (const UserError& error) {
    return error.what();
  }
  return {};
}

TEST(ArgosImport, NamesThePlaceOfAnError) {
  EXPECT_EQ(error_of("<argos-configuration>\n<framework>\n</argos-configuration>").rfind("f.argos:3: is no XML", 0),
            0u)
      << error_of("<argos-configuration>\n<framework>\n</argos-configuration>");
  EXPECT_EQ(error_of("<html/>"), "f.argos: begins with <html>; an .argos file begins with <argos-configuration>");
  EXPECT_EQ(error_of("<argos-configuration/>"), "f.argos: holds no <kilobot>");
  EXPECT_EQ(error_of("<argos-configuration>\n<arena size=\"2,x,1\"/></argos-configuration>"),
            "f.argos:2: <arena size=\"2,x,1\">: expected three numbers, as in \"1,2,0\"");
  EXPECT_EQ(error_of("<argos-configuration><arena>\n<kilobot><controller "
                     "config=\"c\"/></kilobot></arena></argos-configuration>"),
            "f.argos:2: <controller config=\"c\">: is defined nowhere");
}

/// How many of 3000 files with random changes are refused.
int refused_of_3000(const std::string& good, Imported (*import)(std::string_view, const std::string&)) {
  std::uint64_t state = 1;
  const auto draw = [&state](std::size_t below) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return static_cast<std::size_t>((state >> 33) % below);
  };
  int refused = 0;
  for (int k = 0; k < 3000; ++k) {
    std::string text = good;
    for (std::size_t changes = 1 + draw(4); changes > 0; --changes) {
      const std::size_t at = draw(text.size());
      if (draw(3) == 0)
        text.erase(at, draw(40));
      else
        text[at] = "<>\"=/,.-9e x\0"[draw(13)];
    }
    try {
      (void)import(text, "f");
    } catch (const UserError&) {
      ++refused;
    }
  }
  return refused;
}

TEST(ArgosImport, SurvivesAnyChangeOfItsFile) {
  const int refused = refused_of_3000(kGather, from_argos);
  EXPECT_GT(refused, 1000);
  EXPECT_LT(refused, 3000);
}

TEST(KilomboImport, TakesOverItsParameters) {
  const Imported imported = from_kilombo(
      R"({"botName": "orbit", "nBots": 30, "formation": "pile", "simulationTime": 60, "commsRadius": 70, "randSeed": 3,
          "msgSuccessRate": 0.8, "speed": 7, "turnRate": 13, "timeStep": 0.04, "mySwitch": 1, "GUI": 0, "histLength": 5})",
      "p.json");
  const proto::Experiment& e = imported.experiment;
  EXPECT_EQ(e.name(), "orbit");
  EXPECT_EQ(e.seed(), 3u);
  EXPECT_EQ(e.duration_s(), 60);
  EXPECT_EQ(e.robots(0).count(), 30u);
  EXPECT_EQ(e.robots(0).behaviour(0), "orbit.c");
  EXPECT_EQ(e.radio().range_mm(), 70);
  EXPECT_NEAR(e.radio().loss(), 0.2, 1e-12);
  EXPECT_EQ(e.motion().straight_speed_mm_s(), 7);
  EXPECT_NEAR(e.motion().turn_speed_mm_s(), 13 * 3.14159265 / 180 * 25, 1e-6);
  EXPECT_TRUE(notes(imported, "mySwitch: is a parameter of the program"));
  EXPECT_TRUE(notes(imported, "timeStep: a tick is 32.768 ms"));
  EXPECT_FALSE(notes(imported, "histLength"));
  EXPECT_THROW((void)from_kilombo("{\"nBots\": \"x\"}", "p.json"), UserError);
  EXPECT_THROW((void)from_kilombo("[1]", "p.json"), UserError);
  EXPECT_THROW((void)from_kilombo("{", "p.json"), UserError);
  EXPECT_THROW((void)from_kilombo("{\"nBots\": 0}", "p.json"), UserError);
}

constexpr const char* kPogosim = R"(---
boundary_condition: periodic
arena_file: arenas/disk.csv
arena_surface: 1.0e6
save_data_period: 2.0
seed: 5
simulation_time: 300.0
time_step: 0.01
initial_formation: aligned_chessboard
chessboard_distance_between_neighbors: 60
objects:
    sun:
        type: static_light
        geometry: global
        value: 3276
    lamp: { type: static_light, geometry: disk, x: 564.2, y: 664.2, radius: 100, value: 10000 }
    boxes: { type: passive_object, geometry: rectangle, nb: 2, body_width: 70, body_height: 50 }
    walls: { type: pogowall, geometry: arena }
    robots:
        type: pogobot
        nb:
            batch_options: [10, 20, 30]
        radius: 26.5
        communication_radius: 80.0
        msg_success_rate: { type: static, rate: 0.9 }
        max_linear_speed: 9.0
        body_restitution: 0.5
        wings: 2
parameters:
    run_duration_min: 1000
)";

TEST(PogosimImport, TakesOverElementsWithACounterpart) {
  const Imported imported = from_pogosim(kPogosim, "c.yaml");
  const proto::Experiment& e = imported.experiment;
  EXPECT_EQ(e.duration_s(), 300);
  EXPECT_EQ(e.seed(), 5u);
  EXPECT_EQ(e.recording().every_s(), 2);
  EXPECT_NEAR(e.arena().circle().radius_mm(), std::sqrt(1e6 / 3.14159265358979), 0.05);
  ASSERT_EQ(e.robots_size(), 1);
  EXPECT_EQ(e.robots(0).count(), 10u);
  EXPECT_EQ(e.robots(0).layout().grid().pitch_mm(), 60);
  EXPECT_EQ(e.robots(0).layout().grid().heading_deg(), 90);
  EXPECT_EQ(e.radio().range_mm(), 96.5);
  EXPECT_NEAR(e.radio().loss(), 0.1, 1e-9);
  EXPECT_EQ(e.motion().straight_speed_mm_s(), 9);
  EXPECT_NEAR(e.light().ambient(), 1023 * 3276 / 32767.0, 0.1);
  ASSERT_EQ(e.light().source_size(), 1);
  EXPECT_NEAR(e.light().source(0).x_mm(), 0, 0.1);
  EXPECT_NEAR(e.light().source(0).y_mm(), 100, 0.1);
  ASSERT_EQ(e.movable_size(), 2);
  EXPECT_EQ(e.movable(0).box().length_mm(), 50);
  EXPECT_GT(e.movable(1).x_mm() - e.movable(0).x_mm(), 70);
}

TEST(PogosimImport, TakesPosesFromTheTableThatItNames) {
  const std::string text = R"(
arena_file: arenas/square.csv
arena_surface: 1.0e6
initial_formation: imported
formation_filename: t.csv
objects: { a: { type: pogobot, nb: 2 }, b: { type: pogobot, nb: 1 } }
)";
  const auto with = [&](const std::string& table, const std::string& more = "") {
    return from_pogosim(text + more, "c.yaml", [table](const std::string& file) {
      return file == "t.csv" ? std::optional(table) : std::nullopt;
    });
  };
  // From pogosim's corner to the centre of 1000 by 1000 mm; rows after the first time are those of a run.
  const Imported imported = with(
      "time,robot_id,x,y,angle\n0,0,500,600,0\n0,1,100,900,3.14159265358979\n0,2,0,0,-1.5707963267949\n1,0,1,1,"
      "0\n");
  ASSERT_EQ(imported.poses.size(), 2u);
  EXPECT_EQ(imported.poses[0].text, "x_mm,y_mm,heading_deg\n0,100,0\n-400,400,180\n");
  EXPECT_EQ(imported.poses[1].text, "x_mm,y_mm,heading_deg\n-500,-500,-90\n");
  EXPECT_EQ(imported.experiment.robots(1).layout().poses().csv(), imported.poses[1].name);
  // Coordinates of another range are stretched to the arena.
  const Imported stretched =
      with("x,y\n10,20\n15,20\n12,21\n",
           "imported_formation_min_coords: [10, 20]\nimported_formation_max_coords: [20, 30]\n");
  EXPECT_EQ(stretched.poses[0].text, "x_mm,y_mm,heading_deg\n-500,-500,0\n0,-500,0\n");
  EXPECT_TRUE(notes(stretched, "lacks angles"));
  EXPECT_THROW(static_cast<void>(with("x,y\n1,2\n1,3\n")), UserError) << "two poses for three robots";
  EXPECT_THROW(static_cast<void>(with("x,z\n1,2\n1,3\n1,4\n")), UserError);
  EXPECT_TRUE(notes(from_pogosim(text, "c.yaml"), "is no CSV file that can be read"));
}

TEST(PogosimImport, NamesTheLinesThatWereNotTakenOver) {
  const Imported imported = from_pogosim(kPogosim, "c.yaml");
  for (const char* note :
       {"2: boundary_condition: periodic", "8: time_step: a tick is", "18: walls: pogowall has no counterpart",
        "nb: is a batch over 10,20,30", "radius: 26.5 mm; Kilobots have 16.5 mm", "body_restitution: collisions",
        "28: wings: has no counterpart", "30: run_duration_min: is a parameter of the program"})
    EXPECT_TRUE(notes(imported, note)) << note << "\n" << experiment_text(imported, "c.yaml");
}

TEST(PogosimImport, NamesThePlaceOfAnError) {
  const auto error = [](const std::string& text) -> std::string {
    try {
      (void)from_pogosim(text, "c.yaml");
    } catch (const UserError& e) {
      return e.what();
    }
    return {};
  };
  EXPECT_EQ(error("a: 1").rfind("c.yaml: has no \"objects:\"", 0), 0u) << error("a: 1");
  EXPECT_EQ(error("objects:\n  r: { nb: x }"), "c.yaml:2: nb: expected a number");
  EXPECT_EQ(error("objects: {}"), "c.yaml: no object is a pogobot");
  EXPECT_EQ(error("objects: {\n  r: [").rfind("c.yaml:", 0), 0u);
  EXPECT_EQ(error("objects: { r: { nb: 0 } }").rfind("c.yaml: r: nb: expected 1 to", 0), 0u);
}

TEST(PogosimImport, SurvivesAnyChangeOfItsFile) {
  const int refused = refused_of_3000(
      kPogosim, [](std::string_view text, const std::string& name) { return from_pogosim(text, name); });
  EXPECT_GT(refused, 300);
  EXPECT_LT(refused, 3000);
}

/// A folder that goes with the object.
class Folder {
 public:
  Folder() {
    std::string name = (std::filesystem::temp_directory_path() / "kilotwin-import-XXXXXX").string();
    path_ = ::mkdtemp(name.data());
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  [[nodiscard]] std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

/// A table of pogosim: robots 7 and 3 of "robots" at two times, robot 0 of "others" later. `ending` chooses the format.
std::filesystem::path pogosim_table(const Folder& folder, const std::string& ending,
                                    const recorder::TableMetadata& about) {
  using recorder::CellType;
  const auto file = folder / ("p" + ending);
  const auto table = recorder::open_table(file,
                                          {{"time", "s", CellType::kNumber},
                                           {"robot_category", "", CellType::kText},
                                           {"robot_id", "", CellType::kInteger},
                                           {"pogobot_ticks", "", CellType::kInteger},
                                           {"x", "mm", CellType::kNumber},
                                           {"y", "mm", CellType::kNumber},
                                           {"angle", "rad", CellType::kNumber}},
                                          about);
  struct Row {
    double time_s;
    const char* category;
    int id;
    double x_mm, y_mm, angle_rad;
  };
  const Row rows[] = {{0, "robots", 7, 100, 50, 1}, {0, "robots", 3, 200, 60, -2},
                      {1, "robots", 7, 110, 50, 4}, {1, "others", 0, 300, 200, 0},
                      {1, "robots", 3, NAN, 60, 0}, {2.5, "robots", 3, 210, 60, -2}};
  for (const Row& row : rows) {
    table->number(row.time_s);
    table->text(row.category);
    table->integer(row.id);
    table->missing();
    std::isnan(row.x_mm) ? table->missing() : table->number(row.x_mm);
    table->number(row.y_mm);
    table->number(row.angle_rad);
    table->end_row();
  }
  table->close();
  return file;
}

TEST(PogosimTable, BecomesTracksAndAnExperimentInBothFormats) {
  const Folder folder;
  for (const std::string ending : {".csv", ".feather"}) {
    const ImportedTable table =
        from_pogosim_table(pogosim_table(folder, ending, {{"arena_width_mm", "400"}, {"arena_height_mm", "300"}}));
    // By category and number: robot 3 is 0, robot 7 is 1, and robot 0 of the other category is 2.
    EXPECT_EQ(table.tracks,
              "run,robot,time_s,x_mm,y_mm,heading_rad\np,1,0,-100,-100,1.000000\np,0,0,0,-90,-2.000000\n"
              "p,1,1,-90,-100,-2.283185\np,2,1,100,50,0.000000\np,0,2.5,10,-90,-2.000000\n")
        << ending;
    const proto::Experiment& e = table.imported.experiment;
    EXPECT_EQ(e.duration_s(), 3);
    EXPECT_EQ(e.arena().width_mm(), 400);
    EXPECT_EQ(e.arena().height_mm(), 300);
    ASSERT_EQ(e.robots_size(), 2);
    EXPECT_EQ(e.robots(0).count(), 2u);
    EXPECT_EQ(e.robots(1).count(), 1u);
    EXPECT_EQ(table.imported.poses.at(0).text, "x_mm,y_mm,heading_deg\n0,-90,-114.592\n-100,-100,57.2958\n");
    EXPECT_EQ(table.imported.poses.at(1).text, "x_mm,y_mm,heading_deg\n100,50,0\n");
    for (const char* words :
         {"400 by 300 mm", "robot_category others: 1 robots", "robot_id: not 0 to 2",
          "pogobot_ticks: not taken over", "1 rows have no position", "commands", "behaviour.c"})
      EXPECT_TRUE(notes(table.imported, words)) << words;
  }
}

TEST(PogosimTable, WithoutAnArenaAllPositionsFit) {
  const Folder folder;
  for (const std::string ending : {".csv", ".feather"}) {
    const ImportedTable table = from_pogosim_table(pogosim_table(folder, ending, {}));
    EXPECT_EQ(table.imported.experiment.arena().width_mm(), 317);
    EXPECT_EQ(table.imported.experiment.arena().height_mm(), 217);
    EXPECT_TRUE(notes(table.imported, "arena: not in the table")) << ending;
  }
}

TEST(PogosimTable, OtherAndDamagedFilesAreRefused) {
  const Folder folder;
  const auto error = [&](const std::string& name, const std::string& content) -> std::string {
    std::ofstream(folder / name, std::ios::binary) << content;
    try {
      static_cast<void>(from_pogosim_table(folder / name));
    } catch (const UserError& e) {
      return e.what();
    }
    return {};
  };
  EXPECT_NE(error("a.csv", "time,x,y\n").find("robot_category"), std::string::npos);
  EXPECT_NE(error("b.feather", "no table").find("is no Arrow file"), std::string::npos);
  const auto file = pogosim_table(folder, ".feather", {{"arena_width_mm", "400"}});
  std::ifstream in(file, std::ios::binary);
  const std::string whole((std::istreambuf_iterator<char>(in)), {});
  EXPECT_EQ(error("whole.feather", whole), "");
  // Any octet may be another one: the file is read or refused.
  int refused = 0;
  for (std::size_t i = 0; i < whole.size(); ++i) {
    std::string changed = whole;
    changed[i] = static_cast<char>(changed[i] ^ (i % 2 == 0 ? 0xff : 0x11));
    refused += !error("changed.feather", changed).empty();
  }
  EXPECT_GT(refused, 200);
  EXPECT_LT(refused, static_cast<int>(whole.size()));
  for (std::size_t size = 0; size < whole.size(); size += 7)
    EXPECT_NE(error("cut.feather", whole.substr(0, size)), "");
}

/// A file with a log, which goes with it.
class LogFile {
 public:
  explicit LogFile(const std::string& text)
      : path_(std::filesystem::temp_directory_path() / ("import-" + std::to_string(getpid()) + ".log")) {
    std::ofstream(path_, std::ios::binary) << text;
  }
  ~LogFile() { std::filesystem::remove(path_); }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  const std::filesystem::path path_;
};

TEST(LogImport, AnArkLogBecomesTracksAndTrackedRobots) {
  const LogFile log(
      "10\t4\t1\t1000\t900\t90\t1\t9\t0\t1500\t1000\t-90\t0\n10.5\t4\t0\t1010\t900\t0\t1\t9\t0\tnan\t2000\t0\t2\n");
  const ImportedLog log_of = from_tracker_log(log.path(), {});
  const std::string run = log.path().stem().string();
  // y up, from the centre of 2000 by 2000 pixels, times from 0; the lost position is left out.
  EXPECT_EQ(log_of.tracks,
            "run,robot,time_s,x_mm,y_mm\n" + run + ",4,0,0,100\n" + run + ",9,0,500,0\n" + run + ",4,0.5,10,100\n");
  const proto::Experiment& e = log_of.imported.experiment;
  ASSERT_EQ(e.robots_size(), 1);
  EXPECT_EQ(e.robots(0).count(), 2u);
  EXPECT_EQ(e.robots(0).body(), proto::RobotGroup::TRACKED);
  EXPECT_EQ(e.arena().width_mm(), 2000);
  ASSERT_EQ(log_of.imported.poses.size(), 1u);
  EXPECT_EQ(log_of.imported.poses[0].text, "x_mm,y_mm,heading_deg\n0,100,90\n500,0,-90\n");
  ASSERT_EQ(e.door_size(), 1);
  EXPECT_EQ(e.door(0).log().format(), proto::LogDoor::ARK);
  ASSERT_EQ(e.door(0).robots().robot_size(), 2);
  EXPECT_EQ(e.door(0).robots().robot(1).name(), "9");
  EXPECT_EQ(e.door(0).robots().robot(1).robot(), 1u);
  for (const char* words : {"orientation", "colour", "state", "commands", "4 to 9", "1 positions are no numbers"})
    EXPECT_TRUE(notes(log_of.imported, words)) << words;
}

TEST(LogImport, ALarsLogIsInPixelsOfItsCamera) {
  const std::string rows =
      "a\nb\nc\nd\ne\nf\ng\nh\ni\n33\t0\t100\t200\t1\t1\t300\t400\t2\n66\t0\t110\t200\t1\t1\t300\t400\t2\n";
  const LogFile log(rows);
  const ImportedLog log_of = from_tracker_log(log.path(), {{}, 0.5});
  const std::string run = log.path().stem().string();
  EXPECT_EQ(log_of.tracks, "run,robot,time_s,x_mm,y_mm\n" + run + ",0,0,-430,200\n" + run + ",1,0,-330,100\n" +
                               run + ",0,0.033,-425,200\n" + run + ",1,0.033,-330,100\n");
  const proto::Experiment& e = log_of.imported.experiment;
  EXPECT_EQ(e.arena().width_mm(), 960);
  EXPECT_EQ(e.arena().height_mm(), 600);
  ASSERT_EQ(e.door_size(), 1);
  EXPECT_EQ(e.door(0).log().format(), proto::LogDoor::LARS);
  EXPECT_FALSE(e.door(0).has_robots()) << "numbers count from 0";
  for (const char* words : {"header: nine lines", "colour", "commands"})
    EXPECT_TRUE(notes(log_of.imported, words)) << words;
  const auto error = [&](std::optional<double> unit_mm) -> std::string {
    try {
      static_cast<void>(from_tracker_log(log.path(), {{}, unit_mm}));
    } catch (const UserError& refused) {
      return refused.what();
    }
    return {};
  };
  EXPECT_NE(error({}).find("give --unit-mm"), std::string::npos) << error({});
  EXPECT_NE(error(0.001).find("smaller than a robot"), std::string::npos) << error(0.001);
}

TEST(KilomboImport, RefusesNumbersBeyondItsFields) {
  for (const char* wrong :
       {R"({"nBots": 1e10})", R"({"randSeed": 1e300})", R"({"nBots": 1e999})", R"({"nBots": -1})"})
    EXPECT_THROW(static_cast<void>(from_kilombo(wrong, "k.json")), UserError) << wrong;
  EXPECT_EQ(from_kilombo(R"({"nBots": 7.5, "randSeed": 12})", "k.json").experiment.seed(), 12u);
}

TEST(LogImport, ALineThatIsNoneIsNamed) {
  const LogFile log("10\t4\t1\t1000\t900\t90\n11\t4\t1\there\t900\t90\n");
  try {
    static_cast<void>(from_tracker_log(log.path(), {}));
    FAIL();
  } catch (const UserError& error) {
    EXPECT_NE(std::string(error.what()).find(":2:8: x is \"here\""), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace kilotwin::importers
