// Deployments c and d of docs/how-to/swap-deployments.md. A second, independent experiment plays the real world: its robots are
// seen in pictures alone, and are driven through a serial line alone. Its states, which nothing of the deployment reads, are the
// truth. Where robots get lost, as a busy machine may leave the run without pictures, all is done again at half the pace.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "clients/observe/observer.hpp"
#include "core/base/ids.hpp"
#include "core/base/pose.hpp"
#include "core/federation/topics.hpp"
#include "tests/system/ceiling.hpp"
#include "tests/system/own_domain.hpp"
#include "tests/system/program.hpp"

namespace kilotwin::test {
namespace {

namespace fs = std::filesystem;

const Ceiling kCeiling{700, 500};
constexpr int kRobots = 5;
constexpr std::size_t kSimulated = 6;   // of deployment d
constexpr double kPictures_per_s = 24;  // simulated
constexpr double kDegree = kPi / 180;

/// A state of a run: what an observer saw, and when that was.
struct Moment {
  double wall_s = 0, time_s = 0;
  std::vector<Pose> poses;
  std::vector<std::uint8_t> leds, life_cycles;
  std::vector<bool> drives_straight;
};

/// Keeps the states of the runs on a domain.
class Witness {
 public:
  explicit Witness(const std::string& domain)
      : observer_({static_cast<std::uint32_t>(std::stoul(domain)), {}}),
        thread_([this](const std::stop_token& stop) { watch(stop); }) {}

  /// Simulated time of the newest state.
  [[nodiscard]] double time_s() {
    const std::lock_guard lock(mutex_);
    return moments_.empty() ? 0 : moments_.back().time_s;
  }
  [[nodiscard]] std::vector<Moment> moments() {
    const std::lock_guard lock(mutex_);
    return moments_;
  }

 private:
  void watch(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      if (observer_.wait(std::chrono::milliseconds(50)) != observe::News::kState) continue;
      const observe::SwarmAt& state = *observer_.state();
      const SwarmView& swarm = state.swarm;
      Moment moment;
      moment.wall_s = 1e-9 * static_cast<double>(state.wall_ns);
      moment.time_s = state.time_s;
      for (std::uint32_t i = 0; i < swarm.robots(); ++i) {
        moment.poses.push_back({swarm.x_mm[i], swarm.y_mm[i], swarm.heading_rad[i]});
        moment.drives_straight.push_back(swarm.motor_left[i] > 0 && swarm.motor_right[i] > 0);
      }
      moment.leds = swarm.led;
      moment.life_cycles = swarm.life_cycle;
      const std::lock_guard lock(mutex_);
      // A state that is repeated while the run stands still is the same state.
      if (moments_.empty() || moment.time_s > moments_.back().time_s) moments_.push_back(std::move(moment));
    }
  }

  std::mutex mutex_;
  std::vector<Moment> moments_;
  observe::Observer observer_;
  std::jthread thread_;
};

/// UTC.
double wall_now_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

/// When the tracker's samples were taken and when they came, UTC.
class Samples {
 public:
  explicit Samples(const std::string& domain)
      : participant_({static_cast<std::uint32_t>(std::stoul(domain)), {}}),
        reader_(participant_, topics::tracker_frames(),
                [this](const PublicTrackerFrame& sample, dds::SampleState state) {
                  if (state.valid) add(sample.capture_ns);
                }) {}

  /// How many were taken after an instant and have come before another.
  [[nodiscard]] long between(double taken_after_s, double come_before_s) {
    const std::lock_guard lock(mutex_);
    return std::count_if(samples_.begin(), samples_.end(), [&](const std::pair<double, double>& sample) {
      return sample.first > taken_after_s && sample.second < come_before_s;
    });
  }

 private:
  void add(std::int64_t capture_ns) {
    using std::chrono::duration, std::chrono::steady_clock;
    const double now_s = wall_now_s();
    const double steady_s = duration<double>(steady_clock::now().time_since_epoch()).count();
    const std::lock_guard lock(mutex_);
    samples_.emplace_back(now_s - (steady_s - 1e-9 * static_cast<double>(capture_ns)), now_s);
  }

  std::mutex mutex_;
  std::vector<std::pair<double, double>> samples_;
  dds::Participant participant_;
  dds::Reader<PublicTrackerFrame> reader_;
};

/// A robot of the real world at one instant.
struct Truth {
  Pose pose;
  std::uint8_t led = 0;
  bool straight = false;   ///< it has driven straight for 2 s
  double led_since_s = 0;  ///< wall time at which its LED last changed
  bool has_driven = false;
  bool is_free = false;  ///< it has touched neither a wall nor another robot for 2 s
};

/// The real world over time, robot by robot.
class World {
 public:
  explicit World(std::vector<Moment> moments) : moments_(std::move(moments)), facts_(moments_.size()) {
    for (std::size_t robot = 0; robot < kRobots; ++robot) tell(robot);
  }
  /// Nothing where states are missing.
  [[nodiscard]] std::optional<Truth> at(double wall_s, std::size_t robot) const {
    const auto after = std::upper_bound(moments_.begin(), moments_.end(), wall_s,
                                        [](double wall, const Moment& moment) { return wall < moment.wall_s; });
    constexpr double kMostApart_s = 0.2;  // simulated
    if (after == moments_.begin() || after == moments_.end()) return std::nullopt;
    const Moment &a = *(after - 1), &b = *after;
    if (b.time_s - a.time_s > kMostApart_s) return std::nullopt;
    const double share = (wall_s - a.wall_s) / (b.wall_s - a.wall_s);
    const Pose &from = a.poses[robot], &to = b.poses[robot];
    Truth truth = facts_[static_cast<std::size_t>(after - moments_.begin()) - 1][robot];
    truth.pose = {std::lerp(from.x_mm, to.x_mm, share), std::lerp(from.y_mm, to.y_mm, share),
                  wrapped(from.heading_rad + share * wrapped(to.heading_rad - from.heading_rad))};
    return truth;
  }
  [[nodiscard]] bool any_led(std::uint8_t led) const {
    return std::any_of(moments_.begin(), moments_.end(), [&](const Moment& moment) {
      return std::find(moment.leds.begin(), moment.leds.end(), led) != moment.leds.end();
    });
  }

 private:
  void tell(std::size_t robot) {
    constexpr double kStraight_s = 2, kFree_s = 2, kDriven_mm = 15;
    double straight_since = 1e9, led_since_s = 0, driven_mm = 0, touched = -1e9;
    for (std::size_t n = 0; n < moments_.size(); ++n) {
      const Moment& now = moments_[n];
      const double t = now.time_s;
      if (!now.drives_straight[robot]) straight_since = 1e9;
      if (now.drives_straight[robot] && straight_since > t) straight_since = t;
      if (n > 0 && now.leds[robot] != moments_[n - 1].leds[robot]) led_since_s = now.wall_s;
      if (n > 0) driven_mm += distance_mm(now.poses[robot], moments_[n - 1].poses[robot]);
      if (touches(now, robot)) touched = t;
      Truth& truth = facts_[n].emplace_back();
      truth.led = now.leds[robot];
      truth.straight = t - straight_since >= kStraight_s;
      truth.is_free = t - touched >= kFree_s;
      truth.led_since_s = led_since_s;
      truth.has_driven = driven_mm > kDriven_mm;
    }
  }
  /// Whether something may hold the robot: its motors then turn it unseen, or push it to a side.
  static bool touches(const Moment& moment, std::size_t robot) {
    constexpr double kRadius_mm = 16.5, kNear_mm = 1;
    const Pose& pose = moment.poses[robot];
    if (kCeiling.width_mm / 2 - std::abs(pose.x_mm) < kRadius_mm + kNear_mm) return true;
    if (kCeiling.height_mm / 2 - std::abs(pose.y_mm) < kRadius_mm + kNear_mm) return true;
    for (std::size_t other = 0; other < moment.poses.size(); ++other)
      if (other != robot && distance_mm(pose, moment.poses[other]) < 2 * kRadius_mm + kNear_mm) return true;
    return false;
  }
  static double distance_mm(const Pose& a, const Pose& b) { return std::hypot(a.x_mm - b.x_mm, a.y_mm - b.y_mm); }

  std::vector<Moment> moments_;
  std::vector<std::vector<Truth>> facts_;
};

struct Errors {
  double square_sum = 0;
  long count = 0;
  void add(double error) {
    square_sum += error * error;
    ++count;
  }
  void add(const Errors& other) {
    square_sum += other.square_sum;
    count += other.count;
  }
  [[nodiscard]] double rms() const { return count == 0 ? 0 : std::sqrt(square_sum / static_cast<double>(count)); }
};

struct Comparison {
  Errors position_mm;
  // Headings: of free robots after straight motion, of all free ones, of others.
  Errors straight_deg, free_deg, touching_deg;
  long led_right = 0, leds = 0, steady_right = 0, steady_leds = 0, free_right = 0, free_leds = 0, absent = 0;
};

/// The hue, as the tracker's classes: which channels are lit.
int channels(std::uint8_t led) {
  return ((led & 3) != 0) | ((led >> 2 & 3) != 0) << 1 | ((led >> 4 & 3) != 0) << 2;
}

/// Robot `first + i` of the deployment against the world's robot `whose[i]`.
Comparison compare(const World& world, const std::vector<Moment>& seen, Samples& samples, std::size_t first,
                   const std::vector<std::size_t>& whose, double from_s) {
  // The tracker needs at most two pictures for a new colour; a sample that has just come has no effect yet.
  constexpr long kLooks = 3;
  Comparison result;
  for (const Moment& moment : seen) {
    if (moment.time_s < from_s) continue;
    for (std::size_t i = 0; i < kRobots; ++i) {
      const std::size_t robot = first + i;
      const std::optional<Truth> truth = world.at(moment.wall_s, whose[i]);
      if (!truth) continue;
      if (moment.life_cycles[robot] == static_cast<std::uint8_t>(LifeCycle::kAbsent)) {
        ++result.absent;
        continue;
      }
      const Pose& pose = moment.poses[robot];
      result.position_mm.add(std::hypot(pose.x_mm - truth->pose.x_mm, pose.y_mm - truth->pose.y_mm));
      const bool right = channels(moment.leds[robot]) == channels(truth->led);
      ++result.leds;
      result.led_right += right ? 1 : 0;
      if (samples.between(truth->led_since_s, moment.wall_s) >= kLooks) {
        ++result.steady_leds;
        result.steady_right += right ? 1 : 0;
        if (truth->is_free) {
          ++result.free_leds;
          result.free_right += right ? 1 : 0;
        }
      }
      // Nobody can know the heading of a robot that has not moved.
      if (!truth->has_driven) continue;
      const double error_deg = wrapped(pose.heading_rad - truth->pose.heading_rad) / kDegree;
      (truth->is_free ? result.free_deg : result.touching_deg).add(error_deg);
      if (truth->is_free && truth->straight) result.straight_deg.add(error_deg);
    }
  }
  return result;
}

/// For each robot of the deployment, from `first` on, the robot of the world at its place. Nothing where one is at no place.
std::optional<std::vector<std::size_t>> nearest(const World& world, const Moment& moment, std::size_t first) {
  std::vector<std::size_t> whose(kRobots);
  for (std::size_t i = 0; i < kRobots; ++i) {
    const Pose& pose = moment.poses[first + i];
    double least_mm = 1e9;
    for (std::size_t robot = 0; robot < kRobots; ++robot) {
      const std::optional<Truth> truth = world.at(moment.wall_s, robot);
      if (!truth) continue;
      const double off_mm = std::hypot(pose.x_mm - truth->pose.x_mm, pose.y_mm - truth->pose.y_mm);
      if (off_mm >= least_mm) continue;
      least_mm = off_mm;
      whose[i] = robot;
    }
    if (least_mm >= 5) return std::nullopt;
  }
  return whose;
}

class Deployments : public testing::Test {
 protected:
  Deployments() { write(scratch_ / "ceiling.yaml", kCeiling.calibration()); }

  [[nodiscard]] static std::string arena() {
    return fmt::format("arena {{ width_mm: {} height_mm: {} }}\n", kCeiling.width_mm, kCeiling.height_mm);
  }
  [[nodiscard]] std::unique_ptr<Process> start(const std::string& file, const Words& more) const {
    Words words{file};
    words.insert(words.end(), more.begin(), more.end());
    return std::make_unique<Process>(words, scratch_.path());
  }
  /// `attempt` judges a comparison, or leaves it to the next attempt.
  template <class Attempt> void at_a_pace_that_is_kept(Attempt attempt) {
    for (pace_ = 1; pace_ >= kSlowest && !judged_ && !HasFatalFailure(); pace_ /= 2) attempt();
    EXPECT_TRUE(judged_);
  }
  /// Robots that get lost, or are off, are signs of a busy machine or of a bad tracker: the slowest attempt decides.
  void judge(const Comparison& result) {
    fmt::print("pace {}: ", pace_);
    print(result);
    if (!is_as_asked(result) && pace_ > kSlowest) return;
    judged_ = true;
    expect_as_asked(result);
  }
  std::unique_ptr<Process> start_run(const std::string& file, const std::string& domain, const std::string& out,
                                     const Words& more = {}) {
    Words words{"run",  scratch_ / file, "--pace",      fmt::format("{}", pace_), "--quiet", "--domain",
                domain, "--out",         scratch_ / out};
    words.insert(words.end(), more.begin(), more.end());
    fs::remove_all(scratch_ / out);
    return start(program(), words);
  }
  /// The camera above the world. It rewrites one picture, and each picture tells when it was taken.
  std::unique_ptr<Process> start_camera() {
    fs::remove(scratch_ / "ceiling.jpg");
    return start(KILOTWIN_VISION, {"cameras", "--domain", there_, "--picture", scratch_ / "ceiling.jpg", "--size",
                                   kCeiling.size(), "--fps", fmt::format("{}", kPictures_per_s * pace_), "--noise",
                                   "3", "--blur", "0.7", "--uneven-light", "0.2"});
  }
  std::unique_ptr<Process> start_tracker(const Words& more = {}) {
    fs::remove(scratch_ / "robots.csv");  // of an attempt before
    Words words{"track",
                scratch_ / "ceiling.jpg",
                "--watch",
                "--calibration",
                scratch_ / "ceiling.yaml",
                "--arena",
                kCeiling.arena(),
                "--domain",
                here_,
                "--name",
                "ceiling",
                "--out",
                scratch_ / "robots.csv"};
    words.insert(words.end(), more.begin(), more.end());
    return start(KILOTWIN_VISION, words);
  }
  /// One attempt of each deployment.
  void play_c();
  void play_d();
  /// Whether expect_as_asked() would pass, with no robot lost at any time.
  static bool is_as_asked(const Comparison& result) {
    Errors overall = result.free_deg;
    overall.add(result.touching_deg);
    return result.absent == 0 && result.position_mm.count > 1000 && result.straight_deg.count > 100 &&
           result.position_mm.rms() < 1 && result.straight_deg.rms() < 5 && result.free_deg.rms() < 10 &&
           overall.rms() < 10 && leds_are_as_asked(result);
  }
  static bool leds_are_as_asked(const Comparison& result) {
    return static_cast<double>(result.free_right) > 0.99 * static_cast<double>(result.free_leds) &&
           static_cast<double>(result.steady_right) > 0.99 * static_cast<double>(result.steady_leds);
  }
  static void print(const Comparison& result) {
    const auto percent = [](long right, long of) {
      return 100 * static_cast<double>(right) / static_cast<double>(std::max(1L, of));
    };
    Errors overall = result.free_deg;
    overall.add(result.touching_deg);
    fmt::print(
        "[ measured ] position {:.2f} mm; heading of free robots {:.1f} deg after 2 s of straight motion ({} "
        "values), "
        "{:.1f} deg whatever they did ({}); of robots that touch others or walls {:.1f} deg ({}); overall {:.1f} "
        "deg; LED "
        "{:.2f} % (of free robots {:.2f} %; just after changes too: {:.2f} %); absent in {} of {}\n",
        result.position_mm.rms(), result.straight_deg.rms(), result.straight_deg.count, result.free_deg.rms(),
        result.free_deg.count, result.touching_deg.rms(), result.touching_deg.count, overall.rms(),
        percent(result.steady_right, result.steady_leds), percent(result.free_right, result.free_leds),
        percent(result.led_right, result.leds), result.absent, result.position_mm.count);
  }
  static void expect_as_asked(const Comparison& result) {
    Errors overall = result.free_deg;
    overall.add(result.touching_deg);
    EXPECT_GT(result.position_mm.count, 1000);
    EXPECT_GT(result.straight_deg.count, 100);
    EXPECT_LT(result.absent, result.position_mm.count / 100);
    EXPECT_LT(result.position_mm.rms(), 1);
    EXPECT_LT(result.straight_deg.rms(), 5);
    EXPECT_LT(result.free_deg.rms(), 10);
    // Robots that touch others or walls turn without moving, and are a part of the claim.
    EXPECT_LT(overall.rms(), 10);
    EXPECT_TRUE(leds_are_as_asked(result));
  }
  void end(Process& run, const std::string& out) {
    run.signal(SIGINT);
    run.wait(60);
    const Outcome verified = kilotwin({"replay", scratch_ / out, "--verify"}, scratch_);
    EXPECT_EQ(verified.status, 0) << verified.err;
  }

  static constexpr double kSlowest = 0.25;
  Scratch scratch_;
  double pace_ = 1;
  bool judged_ = false;
  const OwnDomain own_here_, own_there_;
  const std::string &here_ = own_here_.name, &there_ = own_there_.name;
};

TEST_F(Deployments, CTheSimulatedStationDrivesRobotsThatACameraSees) {
  const std::string robots =
      fmt::format("robots {{ count: {} behaviour: \"{}\" layout {{ grid {{ pitch_mm: 90 }} }} }}\n", kRobots,
                  source("behaviours/forage.c"));
  write(scratch_ / "world.txtpb", "name: \"world\" duration_s: 900 seed: 5\n" + arena() + robots);
  // The experiment of deployment a; options alone make it deployment c.
  write(
      scratch_ / "foraging.txtpb",
      "name: \"foraging\" duration_s: 900\n" + arena() + robots +
          "station {\n"
          "  environment { plugin { built_in: \"identify\" parameter { name: \"wait_s\" value: \"2\" } } }\n"
          "  environment { foraging { home_x_mm: 200 home_y_mm: 0 home_radius_mm: 90 food_x_mm: -200 food_y_mm: 0 "
          "food_radius_mm: 90 } }\n"
          "}\n");
  at_a_pace_that_is_kept([this] { play_c(); });
}

void Deployments::play_c() {
  fs::remove(scratch_ / "port");  // of an attempt before
  const auto virtual_controller = start(program(), {"ohc", "--pty", scratch_ / "port", "--domain", there_});
  ASSERT_TRUE(eventually([&] { return fs::is_symlink(scratch_ / "port"); }));
  const auto camera = start_camera();
  Witness of_world(there_), of_run(here_);
  Samples samples(here_);
  const auto world_run = start_run("world.txtpb", there_, "world");
  ASSERT_TRUE(virtual_controller->says("run world", 60));
  ASSERT_TRUE(eventually([&] { return fs::exists(scratch_ / "ceiling.jpg"); }, 60));
  const auto tracker = start_tracker({"--identify"});
  const auto controller = start(program(), {"ohc", "--serial", scratch_ / "port", "--domain", here_});
  ASSERT_TRUE(controller->says("waiting for a run", 30));
  const auto run = start_run(
      "foraging.txtpb", here_, "run",
      {"--set", "robots.body=TRACKED", "--set", "robots.says.shadow=true", "--set", "tracking.start=WHEN_SEEN"});
  if (!tracker->says(fmt::format("identification: {0} of {0} robots have their numbers", kRobots),
                     static_cast<int>(120 / pace_))) {
    EXPECT_GT(pace_, kSlowest) << "the robots were not identified";
    return;
  }
  const double from_s = of_run.time_s() + 3;
  constexpr double kLasts_s = 20;
  ASSERT_TRUE(eventually([&] { return of_run.time_s() > from_s + kLasts_s; }, 200));
  end(*run, "run");
  world_run->signal(SIGINT);
  world_run->wait(60);
  const World world(of_world.moments());
  constexpr std::uint8_t kRed = 3;
  judge(compare(world, of_run.moments(), samples, 0, {0, 1, 2, 3, 4}, from_s));
  if (!judged_) return;
  EXPECT_TRUE(world.any_led(kRed)) << "a robot takes a load when the station says so";
}

/// Robots of the real world that walk at random, with LEDs that tell nothing of their motion.
constexpr const char* kWander = R"(#include <kilolib.h>
static uint32_t leg_ends_at, lamp_ends_at;
static void loop(void) {
  static const uint8_t lamps[4] = {RGB(0, 0, 0), RGB(3, 0, 0), RGB(0, 3, 0), RGB(0, 0, 3)};
  if (kilo_ticks >= lamp_ends_at) {
    set_color(lamps[rand_soft() >> 3 & 3]);
    lamp_ends_at = kilo_ticks + 3 * TICKS_PER_SEC;
  }
  if (kilo_ticks < leg_ends_at) return;
  uint8_t choice = rand_soft();
  leg_ends_at = kilo_ticks + TICKS_PER_SEC + choice % (4 * TICKS_PER_SEC);
  spinup_motors();
  switch (choice >> 6) {
    case 0: set_motors(kilo_turn_left, 0); break;
    case 1: set_motors(0, kilo_turn_right); break;
    default: set_motors(kilo_straight_left, kilo_straight_right); break;
  }
  if (choice % 16 == 0) set_motors(0, 0);
}
static void setup(void) { rand_seed(rand_hard()); }
int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }
)";

TEST_F(Deployments, DSimulatedRobotsMoveAmongThoseThatACameraSees) {
  write(scratch_ / "wander.c", kWander);
  write(scratch_ / "world.txtpb",
        fmt::format(
            "name: \"world\" duration_s: 900 seed: 3\n{}robots {{ count: {} behaviour: \"wander.c\" layout {{ "
            "grid {{ pitch_mm: 110 }} }} }}\n",
            arena(), kRobots));
  write(scratch_ / "hybrid.txtpb",
        fmt::format("name: \"hybrid\" duration_s: 900\n{}tracker {{ source: \"ceiling\" first_robot: {} }}\n"
                    "tracking {{ start: WHEN_SEEN }}\n"
                    "robots {{ count: {} behaviour: \"{}\" layout {{ y_mm: -180 grid {{ pitch_mm: 60 }} }} }}\n"
                    "robots {{ count: {} body: TRACKED layout {{ y_mm: 150 grid {{ pitch_mm: 60 }} }} }}\n",
                    arena(), kSimulated, kSimulated, source("behaviours/disperse.c"), kRobots));
  at_a_pace_that_is_kept([this] { play_d(); });
}

void Deployments::play_d() {
  const auto camera = start_camera();
  Witness of_world(there_), of_run(here_);
  Samples samples(here_);
  const auto world_run = start_run("world.txtpb", there_, "world");
  ASSERT_TRUE(eventually([&] { return fs::exists(scratch_ / "ceiling.jpg"); }, 60));
  const auto tracker = start_tracker();
  const auto run = start_run("hybrid.txtpb", here_, "run");
  constexpr double kFrom_s = 5, kLasts_s = 16;
  ASSERT_TRUE(eventually([&] { return of_run.time_s() > kFrom_s + kLasts_s; }, 200));
  end(*run, "run");
  world_run->signal(SIGINT);
  world_run->wait(60);
  const World world(of_world.moments());
  const std::vector<Moment> seen = of_run.moments();
  // Tracks are assigned to robots once, by place, and keep their robots.
  const auto begin = std::find_if(seen.begin(), seen.end(), [](const Moment& m) { return m.time_s >= kFrom_s; });
  ASSERT_NE(begin, seen.end());
  const auto whose = nearest(world, *begin, kSimulated);
  if (!whose) {
    EXPECT_GT(pace_, kSlowest) << "a tracked robot is where no robot is";
    return;
  }
  judge(compare(world, seen, samples, kSimulated, *whose, kFrom_s));
  if (!judged_) return;
  const auto end = std::find_if(seen.rbegin(), seen.rend(), [&](const Moment& m) { return world.at(m.wall_s, 0); });
  ASSERT_NE(end, seen.rend());
  EXPECT_EQ(nearest(world, *end, kSimulated), whose) << "tracked robots have exchanged their numbers";
}

}  // namespace
}  // namespace kilotwin::test
