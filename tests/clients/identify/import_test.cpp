// Import of ARK logs and of exported recordings.
#include "clients/identify/data/import.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <random>
#include <string>

#include "clients/identify/data/measured_set.hpp"
#include "clients/identify/data/table_import.hpp"
#include "core/base/error.hpp"
#include "core/os/files.hpp"

namespace kilotwin::identify {
namespace {

namespace fs = std::filesystem;

class ImportTest : public testing::Test {
 protected:
  ImportTest()
      : folder_(fs::path(testing::TempDir()) /
                ("import-" + std::to_string(getpid()) + "-" +
                 std::string(testing::UnitTest::GetInstance()->current_test_info()->name()))) {
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "from");
  }
  ~ImportTest() override { fs::remove_all(folder_); }

  void give(const std::string& name, const std::string& content) {
    os::write_file(folder_ / "from" / name, content);
  }
  MeasuredSet imported() { return load_or_import(folder_ / "from"); }
  /// The message of the import's error.
  std::string complaint() {
    try {
      (void)imported();
    } catch (const UserError& error) {
      return error.what();
    }
    return "";
  }

  fs::path folder_;
};

TEST_F(ImportTest, ArkLogsInTheMiddleAndUpright) {
  give("day1.txt", "0.1\t3\t0\t1000\t1000\t90\n0.1\t12\t2\t1250\t900\t-45.5\t1\n0.6\t3\t0\t1001.5\t998\t91\n");
  give("day2.txt", "0\t3\t1\t0\t0\t0\n");
  const MeasuredSet set = imported();
  ASSERT_EQ(set.runs.size(), 2U);
  EXPECT_EQ(set.runs[0].name, "day1");
  EXPECT_EQ(set.runs[1].name, "day2");
  EXPECT_FALSE(set.has_headings);
  ASSERT_EQ(set.runs[0].tracks.size(), 2U);
  EXPECT_EQ(set.runs[0].tracks[0].robot, 3U);
  ASSERT_EQ(set.runs[0].tracks[0].samples.size(), 2U);
  EXPECT_DOUBLE_EQ(set.runs[0].tracks[0].samples[1].time_s, 0.6);
  EXPECT_DOUBLE_EQ(set.runs[0].tracks[0].samples[1].x_mm, 1.5);
  EXPECT_DOUBLE_EQ(set.runs[0].tracks[0].samples[1].y_mm, 2);
  EXPECT_DOUBLE_EQ(set.runs[0].tracks[1].samples[0].x_mm, 250);
  EXPECT_DOUBLE_EQ(set.runs[0].tracks[1].samples[0].y_mm, 100);
  EXPECT_DOUBLE_EQ(set.runs[1].tracks[0].samples[0].x_mm, -1000);
  EXPECT_DOUBLE_EQ(set.runs[1].tracks[0].samples[0].y_mm, 1000);
}

TEST_F(ImportTest, NamesOfColumnsAndACutLastLine) {
  give("a.log", "t\tid\tcolour\tx\ty\torientation\r\n1\t0\t0\t10\t20\t0\r\n\r\n2\t0\t0\t11\t20\t0\r\n3\t0\t0\t1");
  EXPECT_EQ(imported().samples(), 2U);
}

TEST_F(ImportTest, TablesOfAnyTrackerByNamesUnitsAndAxes) {
  give("trial.csv", "ID,t,px,py,theta\n7,500,0.1,-0.2,90\n7,1000,,,\n8,500,0.3,0.4,-45\n");
  give("commands.csv", "run,robot,time_s,motion\ntrial,7,0,left\n");
  TableFormat format;
  set_columns(format, "time=t,robot=ID,x=px,y=py,heading=theta");
  format.unit_mm = 1000;
  format.unit_s = 0.001;
  format.degrees = format.image = true;
  const MeasuredSet set = read_tables(folder_ / "from", format);
  ASSERT_EQ(set.tracks(), 2U);
  EXPECT_TRUE(set.has_commands);
  EXPECT_EQ(set.runs[0].name, "trial");
  const Sample& sample = set.runs[0].tracks[0].samples.at(0);
  EXPECT_EQ(set.runs[0].tracks[0].robot, 7U);
  EXPECT_EQ(set.runs[0].tracks[0].samples.size(), 1U) << "a lost robot has no sample";
  EXPECT_DOUBLE_EQ(sample.time_s, 0.5);
  EXPECT_NEAR(sample.x_mm, 100, 1e-9);
  EXPECT_NEAR(sample.y_mm, 200, 1e-9) << "y upwards";
  EXPECT_NEAR(sample.heading_rad, -M_PI / 2, 1e-8) << "anticlockwise";
}

TEST_F(ImportTest, NamesOfColumnsThatAreNoneAreReported) {
  TableFormat format;
  EXPECT_THROW(set_columns(format, "time=t,angle=theta"), UserError);
  EXPECT_THROW(set_columns(format, "time="), UserError);
  give("trial.csv", "id,t,x,y\n1,0,0,0\n");
  try {
    (void)read_tables(folder_ / "from", {});
    FAIL();
  } catch (const UserError& error) {
    EXPECT_NE(std::string(error.what()).find("only id, t, x, y; name it: --columns time=NAME"), std::string::npos)
        << error.what();
  }
}

TEST_F(ImportTest, TablesOfTheCameraTrackerInMillimetres) {
  // Discs of 11 px: 1.5 mm per pixel. Two fragments, one without a heading.
  give("film.csv",
       "frame,time_s,track,x_px,y_px,radius_px,heading_rad,led\n0,0,0,100,50,11,nan,off\n"
       "1,0.1,0,120,50,11,0.5,off\n1,0.1,4,100,250,11,nan,red\n");
  const MeasuredSet set = imported();
  ASSERT_EQ(set.tracks(), 2U);
  EXPECT_FALSE(set.has_headings) << "they follow from the positions";
  EXPECT_EQ(set.runs[0].tracks[1].robot, 1U) << "tracks without a robot's number are numbered anew";
  EXPECT_DOUBLE_EQ(set.runs[0].tracks[0].samples[1].x_mm, 15);
  EXPECT_DOUBLE_EQ(set.runs[0].tracks[0].samples[1].y_mm, 150) << "y upwards";
  EXPECT_DOUBLE_EQ(set.runs[0].tracks[1].samples[0].y_mm, -150);
}

TEST_F(ImportTest, TracksWithoutRobotsAreOtherRobotsInEachFilm) {
  const std::string head = "frame,time_s,track,x_px,y_px,radius_px,heading_rad,led";
  const std::string rows = "\n0,0,0,100,50,11,nan,off\n1,0.1,4,100,250,11,nan,red\n";
  give("one.csv", head + rows);
  give("two.csv", head + rows);
  give("commands.csv", "run,robot,time_s,motion\none,4,0,left\ntwo,0,0,right\n");
  for (const std::uint32_t first : {0U, 7U}) {
    const MeasuredSet set = load_or_import(folder_ / "from", first);
    EXPECT_EQ(set.robots(), (std::vector<std::uint32_t>{first, first + 1, first + 2, first + 3}));
    EXPECT_EQ(set.runs[0].tracks[1].commands.back().motion, Motion::kLeft);
    EXPECT_EQ(set.runs[1].tracks[0].commands.back().motion, Motion::kRight);
    save_measured_set(set, folder_ / "to");
    const MeasuredSet again = load_measured_set(folder_ / "to");
    EXPECT_EQ(again.robots(), set.robots());
    EXPECT_EQ(again.runs[0].tracks[1].commands.back().motion, Motion::kLeft);
  }
  // A robot that the station has identified keeps its number in all films.
  give("one.csv", head + ",robot\n0,0,0,100,50,11,nan,off,12\n");
  give("two.csv", head + ",robot\n0,0,0,100,50,11,nan,off,12\n");
  fs::remove(folder_ / "from" / "commands.csv");
  EXPECT_EQ(load_or_import(folder_ / "from", 7).robots(), (std::vector<std::uint32_t>{12}));
}

TEST_F(ImportTest, TracksWithoutRobotsAreNoRobotsOfANumberedTestSet) {
  give("film.csv", "frame,time_s,track,x_px,y_px,radius_px,heading_rad,led\n0,0,0,100,50,11,nan,off\n");
  const fs::path test = folder_ / "test";
  fs::create_directories(test);
  os::write_file(test / "trajectories.csv", "run,robot,time_s,x_mm,y_mm\na,0,0,1,2\na,5,0,30,2\n");
  const std::uint32_t first = first_number_beside(folder_ / "from", test);
  EXPECT_EQ(first, 6U);
  EXPECT_EQ(load_or_import(folder_ / "from", first).robots(), (std::vector<std::uint32_t>{6}));
  EXPECT_EQ(first_number_beside(folder_ / "from", folder_ / "from"), 0U) << "the test set numbers none";
  EXPECT_EQ(first_number_beside(test, test), 0U) << "all tracks have numbers";
}

TEST_F(ImportTest, RecordingsWithHeadingsAndCommands) {
  give("seed-1.csv",
       "time_s,robot,x_mm,y_mm,heading_rad,led\n0.0000,0,1.5,-2.25,0.5,003\n1.0000,0,2.5,-2.25,0.5,000\n");
  give("commands.csv", "run,robot,time_s,motion\nseed-1,0,0,left\n");
  const MeasuredSet set = imported();
  ASSERT_EQ(set.runs.size(), 1U);
  EXPECT_TRUE(set.has_headings);
  EXPECT_TRUE(set.has_commands);
  EXPECT_DOUBLE_EQ(set.runs[0].tracks[0].samples[0].heading_rad, 0.5);
  EXPECT_DOUBLE_EQ(set.runs[0].tracks[0].samples[1].x_mm, 2.5);
  EXPECT_EQ(set.runs[0].tracks[0].commands.back().motion, Motion::kLeft);
}

TEST_F(ImportTest, ADataDirectoryIsLeftAsItIs) {
  give("trajectories.csv", "run,robot,time_s,x_mm,y_mm\n");
  give("notes.txt", "0\t0\t0\t0\t0\t0\n");
  EXPECT_TRUE(importable(folder_ / "from").empty());
}

TEST_F(ImportTest, NamesTheWrongLine) {
  const std::string file = (folder_ / "from" / "x.tsv").string();
  give("x.tsv", "0\t1\t0\t5\t5\t0\n1\t1\t0\tleft\t5\t0\n");
  EXPECT_EQ(complaint(), file + ":2:7: x is \"left\"; give pixels");
  give("x.tsv", "0\t-1\t0\t5\t5\t0\n");
  EXPECT_EQ(complaint(), file + ":1:3: id is \"-1\"; give a whole number");
  give("x.tsv", "0\t1\t0\t5\t5\t0\n1\t1\t0\n");
  EXPECT_EQ(complaint().substr(0, file.size() + 9), file + ":2:1: 3 c");
  give("x.tsv", "0\t1\t0\tnan\t5\t0\n");
  EXPECT_NE(complaint().find(":1:7: x is \"nan\""), std::string::npos);
  give("x.tsv", "t\tid\tcolour\tx\ty\torientation\n");
  EXPECT_NE(complaint().find("has no rows"), std::string::npos);
}

TEST_F(ImportTest, RefusesAmbiguousAndEmptyDirectories) {
  EXPECT_NE(complaint().find("holds no trajectories.csv"), std::string::npos);
  give("README.txt", "Robots on a table.\nt\tid\n");
  give("other.csv", "a,b\n1,2\n");
  give("empty.log", "");
  EXPECT_NE(complaint().find("other.csv"), std::string::npos);
  give("a.txt", "0\t1\t0\t5\t5\t0\n");
  give("a.tsv", "0\t1\t0\t5\t5\t0\n");
  EXPECT_NE(complaint().find("the same run"), std::string::npos);
  fs::remove(folder_ / "from" / "a.tsv");
  give("b.csv", "time_s,robot,x_mm,y_mm,heading_rad,led\n0,0,1,2,3,000\n");
  EXPECT_NE(complaint().find("not both"), std::string::npos);
}

TEST_F(ImportTest, AnyFileIsReadOrRefused) {
  std::mt19937 dice(11);
  const std::string ark =
      "t\tid\tcolour\tx\ty\torientation\n0.1\t3\t0\t1000\t1000\t90\n0.1\t12\t2\t1250\t900\t-45.5\n0.6\t3\t0\t1001."
      "5\t998\t91\n";
  const std::string recording =
      "time_s,robot,x_mm,y_mm,heading_rad,led\n0.0000,0,1.5,-2.25,0.5,003\n1.0000,0,2.5,-2.25,0.5,000\n";
  const std::string alphabet = "0123456789.-+e\t\n\r ,\"nainfx\0\xff";
  for (int i = 0; i < 1000; ++i) {
    const bool is_ark = i % 2 == 0;
    std::string content = is_ark ? ark : recording;
    for (int k = 0; k < 1 + i % 9; ++k) {
      const std::size_t at = dice() % content.size();
      const char other = alphabet[dice() % alphabet.size()];
      switch (dice() % 3) {
        case 0: content[at] = other; break;
        case 1: content.erase(at, 1 + dice() % 4); break;
        default: content.insert(at, 1, other); break;
      }
      if (content.empty()) content = " ";
    }
    const std::string name = is_ark ? "f.txt" : "f.csv";
    give(name, content);
    try {
      SetBuilder builder;
      if (is_ark)
        add_ark_log(folder_ / "from" / name, builder);
      else
        add_recording(folder_ / "from" / name, builder);
      // A file that is accepted yields valid rows.
      const MeasuredSet set = builder.finish();
      for (const Track& track : set.runs.at(0).tracks) {
        for (const Sample& s : track.samples)
          EXPECT_TRUE(std::isfinite(s.time_s) && std::isfinite(s.x_mm) && std::isfinite(s.y_mm));
      }
    } catch (const UserError& error) {
      EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace kilotwin::identify
