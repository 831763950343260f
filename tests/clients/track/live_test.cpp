// `kilotwin track --identify` in the whole chain: a run whose robots are tracked, and an independent run that plays the real
// world. Between them: the run's controller on a serial line, the world's virtual controller, its camera, the tracker.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "clients/recorder/reader.hpp"
#include "tests/system/ceiling.hpp"
#include "tests/system/own_domain.hpp"
#include "tests/system/program.hpp"

namespace kilotwin::test {
namespace {

namespace fs = std::filesystem;

constexpr int kRobots = 8;
const Ceiling kCeiling{600, 400};

std::string world() {
  return fmt::format(R"(
name: "world"
duration_s: 900
seed: 5
arena {{ width_mm: {} height_mm: {} }}
robots {{ count: {} behaviour: "{}" layout {{ random {{}} }} }}
recording {{ every_s: 0.5 }}
)",
                     kCeiling.width_mm, kCeiling.height_mm, kRobots, source("behaviours/housekeeping.c"));
}

std::string tracked() {
  return fmt::format(R"(
name: "tracked"
duration_s: 900
arena {{ width_mm: {} height_mm: {} }}
tracker {{ source: "ceiling" }}
tracking {{ start: WHEN_SEEN }}
robots {{ count: {} body: TRACKED layout {{ grid {{ pitch_mm: 45 }} }} }}
station {{ environment {{ plugin {{ built_in: "identify" parameter {{ name: "wait_s" value: "3" }} }} }} }}
recording {{ every_s: 0.5 }}
)",
                     kCeiling.width_mm, kCeiling.height_mm, kRobots);
}

int free_port() {
  const int descriptor = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t length = sizeof address;
  EXPECT_EQ(bind(descriptor, reinterpret_cast<sockaddr*>(&address), length), 0);
  EXPECT_EQ(getsockname(descriptor, reinterpret_cast<sockaddr*>(&address), &length), 0);
  close(descriptor);
  return ntohs(address.sin_port);
}

proto::StateRecord last_state(const std::string& recording) {
  recorder::Reader reader(recording);
  proto::StateRecord last;
  while (const proto::StateRecord* state = reader.next_state()) last = *state;
  return last;
}

TEST(TrackerLive, RobotsOfAnotherWorldGetTheirNumbersByTheStationsIdentification) {
  const Scratch scratch;
  const OwnDomain own_here, own_there;
  const std::string &here = own_here.name, &there = own_there.name;
  write(scratch / "world.txtpb", world());
  write(scratch / "tracked.txtpb", tracked());
  write(scratch / "ceiling.yaml", kCeiling.calibration());

  Process virtual_controller({program(), "ohc", "--pty", scratch / "port", "--domain", there}, scratch.path());
  ASSERT_TRUE(eventually([&] { return fs::is_symlink(scratch / "port"); }));
  const std::string port = std::to_string(free_port());
  Process cameras({KILOTWIN_VISION, "cameras", "--domain", there, "--mjpeg", port, "--size", kCeiling.size(),
                   "--fps", "10", "--noise", "3"},
                  scratch.path());
  ASSERT_TRUE(cameras.says("camera.mjpg", 60));
  Process world_run({program(), "run", scratch / "world.txtpb", "--pace", "1", "--quiet", "--domain", there,
                     "--out", scratch / "world"},
                    scratch.path());
  ASSERT_TRUE(virtual_controller.says("run world", 60));
  Process tracker({KILOTWIN_VISION, "track", "http://127.0.0.1:" + port + "/camera.mjpg", "--calibration",
                   scratch / "ceiling.yaml", "--arena", kCeiling.arena(), "--domain", here, "--name", "ceiling",
                   "--identify", "--out", scratch / "robots.csv"},
                  scratch.path());
  ASSERT_TRUE(tracker.says(" 8 robots", 90));
  Process controller({program(), "ohc", "--serial", scratch / "port", "--domain", here}, scratch.path());
  ASSERT_TRUE(controller.says("waiting for a run", 30));
  Process run({program(), "run", scratch / "tracked.txtpb", "--pace", "1", "--quiet", "--domain", here, "--out",
               scratch / "run"},
              scratch.path());
  ASSERT_TRUE(tracker.says("identification: 8 of 8 robots have their numbers", 120));

  // Tracked robot i is the world's robot i: neither program told the other who is where.
  const auto farthest_mm = [&] {
    const proto::StateRecord truth = last_state(scratch / "world/recording.ktrec");
    const proto::StateRecord seen = last_state(scratch / "run/recording.ktrec");
    double farthest = seen.x_mm_size() == kRobots && truth.x_mm_size() == kRobots ? 0 : 1e9;
    for (int i = 0; i < kRobots && farthest < 1e9; ++i)
      farthest = std::max(farthest, std::hypot(seen.x_mm(i) - truth.x_mm(i), seen.y_mm(i) - truth.y_mm(i)));
    return farthest;
  };
  EXPECT_TRUE(eventually([&] { return farthest_mm() < 1; }, 60)) << farthest_mm();
  for (Process* const process : {&run, &world_run, &tracker}) process->signal(SIGINT);
  run.wait(60);
  const auto report = nlohmann::json::parse(read(scratch / "run/station-0.json"));
  EXPECT_EQ(report.at("identified"), kRobots) << report;
  const std::string table = read(scratch / "robots.csv");
  EXPECT_TRUE(table.starts_with("frame,time_s,track,x_px,y_px,radius_px,heading_rad,led,x_mm,y_mm,robot\n"));
  fmt::print("identified: {} of {} robots; poses at most {:.2f} mm off\n", report.at("identified").get<int>(),
             kRobots, farthest_mm());
}

}  // namespace
}  // namespace kilotwin::test
