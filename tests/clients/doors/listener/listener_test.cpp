// Lines of a listener become messages of real robots. They come from files and terminals.
#include "clients/doors/listener/listener.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <random>

#include "clients/doors/listener/line_source.hpp"
#include "core/base/error.hpp"
#include "core/os/descriptor.hpp"
#include "tests/clients/doors/doors.hpp"

namespace kilotwin::doors {
namespace {

constexpr std::uint32_t kUnknown = HeardMessage::kUnknown;

TEST(Listener, TheLineOrTheMessageNamesTheSender) {
  const Door door = test::door(
      "listener { robot: 4 line: '{sender} {type} {data} at {distance}' } robots { first_number: 10 }", 6, 2);
  Listener listener(door);
  const auto heard = listener.heard("11 3 7 8 9 at 55");
  ASSERT_TRUE(heard);
  EXPECT_EQ(heard->robot, 3u) << "robots 2 to 5 are tracked, and their numbers begin with 10";
  EXPECT_EQ(heard->listener, 4u);
  EXPECT_EQ(heard->distance_mm, 55);
  EXPECT_EQ(heard->message, (IrMessage{7, 8, 9, 0, 0, 0, 0, 0, 0, 3}));
  EXPECT_FALSE(listener.heard("99 3 7 at 55"));
  EXPECT_FALSE(listener.heard("voltage 412"));
  EXPECT_EQ(
      listener.in_words(),
      "1 messages; 1 other lines (the first: \"voltage 412\"); 1 messages of no tracked robot (the first: number "
      "99)");

  const Door by_octet = test::door("listener { id_octet: 1 }", 4);
  EXPECT_EQ(Listener(by_octet).heard("0 5 2")->robot, 2u);
  EXPECT_EQ(Listener(by_octet).heard("0 5 2")->listener, kUnknown);
  const Door nearest = test::door("listener { robot: 1 }", 4);
  EXPECT_EQ(Listener(nearest).heard("0 5 2")->robot, kUnknown);
  EXPECT_LT(Listener(nearest).heard("0 5 2")->distance_mm, 0);
}

class Lines : public testing::Test {
 protected:
  Lines() {
    std::string pattern = (std::filesystem::temp_directory_path() / "kilotwin-lines-XXXXXX").string();
    file = mkdtemp(pattern.data());
    folder = file;
    file /= "line.txt";
  }
  ~Lines() override { std::filesystem::remove_all(folder); }
  std::filesystem::path folder, file;
};

TEST_F(Lines, AFileIsReadAsItGrows) {
  std::ofstream(file) << "first\nsec";
  LineSource source(file, 38400);
  EXPECT_EQ(source.read(0.1), std::vector<std::string>{"first"});
  EXPECT_TRUE(source.read(0.1).empty());
  EXPECT_TRUE(source.at_end());
  std::ofstream(file, std::ios::app) << "ond\n\nthird\n";
  EXPECT_EQ(source.read(0.1), (std::vector<std::string>{"second", "", "third"}));
  EXPECT_THROW(LineSource(folder / "none", 38400), UserError);
  EXPECT_THROW(LineSource(folder, 38400), UserError);
  EXPECT_THROW(LineSource(file, 12345), UserError);
}

TEST_F(Lines, ATerminalIsSetToTheSpeedAndReadRaw) {
  const os::Descriptor robot(posix_openpt(O_RDWR | O_NOCTTY));
  ASSERT_GE(robot.get(), 0);
  ASSERT_EQ(grantpt(robot.get()), 0);
  ASSERT_EQ(unlockpt(robot.get()), 0);
  LineSource source(ptsname(robot.get()), 38400);
  termios settings{};
  ASSERT_EQ(tcgetattr(robot.get(), &settings), 0);
  EXPECT_EQ(cfgetispeed(&settings), speed_t{B38400});
  ASSERT_EQ(write(robot.get(), "0 1 2\r\n\x04", 8), 8);
  std::vector<std::string> lines;
  for (int n = 0; n < 50 && lines.empty(); ++n) lines = source.read(0.1);
  EXPECT_EQ(lines, std::vector<std::string>{"0 1 2\r"});
  EXPECT_EQ(source.rest(), "\x04") << "control characters are data";
}

TEST_F(Lines, NoiseOfAnyKindIsCutIntoLinesOfBoundedLength) {
  std::mt19937_64 random(3);
  std::string noise;
  for (int n = 0; n < 300'000; ++n)
    noise += static_cast<char>(random() % 5000 == 0 ? '\n' : static_cast<int>(random() % 256));
  std::ofstream(file, std::ios::binary) << noise;
  LineSource source(file, 38400);
  const Door door = test::door("listener { robot: 0 }", 2);
  Listener listener(door);
  std::size_t lines = 0;
  while (!source.at_end()) {
    for (const std::string& line : source.read(0)) {
      ASSERT_LE(line.size(), 4096u);
      static_cast<void>(listener.heard(line));
      ++lines;
    }
  }
  EXPECT_EQ(lines, static_cast<std::size_t>(std::count(noise.begin(), noise.end(), '\n')));
}

}  // namespace
}  // namespace kilotwin::doors
