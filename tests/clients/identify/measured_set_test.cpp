// Reading returns what was written, in any order of rows and columns. Errors name the place.
#include "clients/identify/data/measured_set.hpp"

#include <gtest/gtest.h>
#include <unistd.h>
#include <zlib.h>

#include <cmath>
#include <fstream>

#include "core/base/error.hpp"

namespace kilotwin::identify {
namespace {

namespace fs = std::filesystem;

class MeasuredSetFiles : public testing::Test {
 protected:
  void SetUp() override {
    directory = fs::temp_directory_path() / ("kilotwin-measured-" + std::to_string(getpid()));
    fs::remove_all(directory);
    fs::create_directories(directory);
  }
  void TearDown() override { fs::remove_all(directory); }
  void write(const std::string& name, const std::string& content) const {
    std::ofstream(directory / name) << content;
  }
  [[nodiscard]] std::string complaint() const {
    try {
      (void)load_measured_set(directory);
    } catch (const UserError& error) {
      return std::string(error.what()).substr(directory.string().size() + 1);
    }
    return "";
  }
  fs::path directory;
};

TEST_F(MeasuredSetFiles, RowsAndColumnsMayStandInAnyOrder) {
  write("trajectories.csv",
        "robot,run,x_mm,time_s,y_mm,led,heading_rad\n7,b,3,1.5,4,000,\n\n7,b,1,0.5,2,000,-0.25\r\n2,a,9,0,8,111,"
        "nan\n");
  write("commands.csv", "run,robot,time_s,motion\nb,7,2,left\nb,7,0,straight\nb,7,1,straight\nc,1,0,stop\n");
  const MeasuredSet set = load_measured_set(directory);
  ASSERT_EQ(set.runs.size(), 2u);
  EXPECT_EQ(set.runs[0].name, "b");
  const Track& track = set.runs[0].tracks.at(0);
  ASSERT_EQ(track.samples.size(), 2u);
  EXPECT_EQ(track.samples[0].time_s, 0.5);
  EXPECT_EQ(track.samples[0].heading_rad, -0.25);
  EXPECT_TRUE(std::isnan(track.samples[1].heading_rad));
  EXPECT_EQ(track.samples[1].y_mm, 4);
  ASSERT_EQ(track.commands.size(), 3u);  // stop, straight, left
  EXPECT_EQ(track.commands[1].motion, Motion::kStraight);
  EXPECT_EQ(track.commands[2].time_s, 2);
  EXPECT_TRUE(set.has_headings && set.has_commands);
  EXPECT_EQ(set.robots(), (std::vector<std::uint32_t>{2, 7}));
}

TEST_F(MeasuredSetFiles, GzippedIsTheSame) {
  const std::string rows = "run,robot,time_s,x_mm,y_mm\nr,0,0,1,2\nr,0,1,3,4\n";
  const gzFile out = gzopen((directory / "trajectories.csv.gz").c_str(), "wb");
  gzwrite(out, rows.data(), static_cast<unsigned>(rows.size()));
  gzclose(out);
  const MeasuredSet set = load_measured_set(directory);
  EXPECT_EQ(set.samples(), 2u);
  EXPECT_FALSE(set.has_headings || set.has_commands);
  EXPECT_EQ(set.runs[0].tracks[0].commands.at(0).motion, Motion::kStraight);
}

TEST_F(MeasuredSetFiles, SavedAndLoadedIsTheSame) {
  write("trajectories.csv",
        "run,robot,time_s,x_mm,y_mm,heading_rad\na,1,0,1,2,0.5\na,1,0.5,1.25,2,\na,3,0,5,6,1\n");
  write("commands.csv", "run,robot,time_s,motion\na,1,0,right\na,1,0.25,stop\n");
  const MeasuredSet set = load_measured_set(directory);
  save_measured_set(set, directory / "again");
  const MeasuredSet again = load_measured_set(directory / "again");
  ASSERT_EQ(again.samples(), set.samples());
  EXPECT_EQ(again.runs[0].tracks[0].samples[1].x_mm, 1.25);
  ASSERT_EQ(again.runs[0].tracks[0].commands.size(), set.runs[0].tracks[0].commands.size());
  EXPECT_EQ(again.runs[0].tracks[0].commands[2].time_s, 0.25);
}

TEST_F(MeasuredSetFiles, ErrorsNameTheirPosition) {
  EXPECT_NE(complaint().find("trajectories.csv"), std::string::npos);
  write("trajectories.csv", "run,robot,time_s,x_mm\n");
  EXPECT_EQ(complaint(),
            "trajectories.csv:1:1: the column y_mm is missing, the header has run, robot, time_s, x_mm; write "
            "run,robot,time_s,x_mm,y_mm[,heading_rad]");
  write("trajectories.csv", "run,robot,time_s,x_mm,y_mm\n");
  EXPECT_NE(complaint().find("no rows"), std::string::npos);
  write("trajectories.csv", "run,robot,time_s,x_mm,y_mm\na,1,0,1\n");
  EXPECT_EQ(complaint(), "trajectories.csv:2:8: the row has 4 cells; the header names 5");
  write("trajectories.csv", "run,robot,time_s,x_mm,y_mm\na,1,0,1,2\na,1,0.5,1e,2\n");
  EXPECT_EQ(complaint(), "trajectories.csv:3:9: x_mm is \"1e\"; give a number");
  write("trajectories.csv", "run,robot,time_s,x_mm,y_mm\na,-1,0,1,2\n");
  EXPECT_EQ(complaint().substr(0, 44), "trajectories.csv:2:3: robot is \"-1\"; give a ");
  write("trajectories.csv", "run,robot,time_s,x_mm,y_mm\na,1,0,1,2\n");
  write("commands.csv", "run,robot,time_s,motion\na,1,0,forward\n");
  EXPECT_EQ(complaint(), "commands.csv:2:7: motion is \"forward\"; give stop, straight, left or right");
  write("trajectories.csv",
        "run,robot,time_s,x_mm,y_mm\n"
        "caf\xe9,1,0,1,2\n");
  EXPECT_EQ(complaint(), "trajectories.csv:2:1: run is not UTF-8; save the table as UTF-8");
}

TEST_F(MeasuredSetFiles, ATableUnderAnotherNameIsNamedWithTheColumnsThatItLacks) {
  write("data.csv", "x,y\n1,2\n");
  EXPECT_EQ(complaint(),
            "data.csv:1:1: the columns run, robot, time_s, x_mm, y_mm are missing, the header has x, y; write "
            "run,robot,time_s,x_mm,y_mm[,heading_rad]");
  write("data.csv", "run,robot,time_s,x_mm,y_mm\na,1,0,1,2\n");
  EXPECT_NE(complaint().find("rename data.csv"), std::string::npos) << complaint();
}

TEST_F(MeasuredSetFiles, QuotesTabsMarksAndLineEndsAreRead) {
  write("trajectories.csv",
        "\xef\xbb\xbfrun\trobot\ttime_s\tx_mm\ty_mm\r\n\"first, \"\"long\"\"\"\t3\t0\t1\t2\r\n");
  const MeasuredSet set = load_measured_set(directory);
  ASSERT_EQ(set.samples(), 1u);
  EXPECT_EQ(set.runs[0].name, "first, \"long\"");
  save_measured_set(set, directory / "again");
  EXPECT_EQ(load_measured_set(directory / "again").runs[0].name, "first, \"long\"");
}

}  // namespace
}  // namespace kilotwin::identify
