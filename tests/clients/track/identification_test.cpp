// Identification: numbers by LEDs. First the rule alone, then on rendered pictures in which robots are exchanged.
#include "clients/track/identification.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "clients/cameras/renderer.hpp"
#include "clients/track/tracker.hpp"
#include "idl/experiment.pb.h"

namespace kilotwin::track {
namespace {

constexpr double kFrame_s = 1.0 / 30;

TEST(Identification, QuestionsAreBroadcastsOfTwoTypes) {
  const auto asks = [](std::uint8_t type, std::uint8_t high, std::uint8_t low) -> int {
    const std::optional<Question> question = question_of(2.5, type, high, low);
    if (!question) return -1;
    EXPECT_EQ(question->time_s, 2.5);
    return question->number ? *question->number : 0xffff;
  };
  EXPECT_EQ(asks(120, 1, 4), 260);
  EXPECT_EQ(asks(119, 0, 7), 7);
  EXPECT_EQ(asks(120, 255, 255), 0xffff);
  EXPECT_EQ(asks(0, 1, 4), -1);
  EXPECT_EQ(asks(0x88, 255, 255), -1);
}

/// Robots without pictures: track i shows `leds[i]`.
class Rule : public testing::Test {
 protected:
  void show(const std::vector<Led>& leds, double for_s) {
    for (const double end_s = time_s_ + for_s; time_s_ < end_s; time_s_ += kFrame_s) {
      robots_.clear();
      for (std::uint32_t i = 0; i < leds.size(); ++i) {
        TrackedRobot robot;
        robot.track = i;
        robot.led = leds[i];
        robots_.push_back(robot);
      }
      identification_.take(time_s_, robots_, follower_);
    }
  }
  void ask(std::uint16_t number) { identification_.take(Question{time_s_, number}); }
  void end() { identification_.take(Question{time_s_, std::nullopt}); }

  double time_s_ = 5;
  std::vector<TrackedRobot> robots_;
  Follower follower_;
  Identification identification_;
  static constexpr Led kR = Led::kRed, kB = Led::kBlue;
};

TEST_F(Rule, TheTrackThatTurnsBlueHasTheNumber) {
  show({Led::kOff, Led::kGreen, Led::kOff}, 0.2);
  ask(12);
  show({kR, kR, kR}, 0.1);
  show({kR, kB, kR}, 0.5);
  EXPECT_EQ(robots_[1].number, 12);
  EXPECT_FALSE(robots_[0].number);
  // The next question: the robot before is blue for a while yet.
  ask(13);
  show({kR, kB, kR}, 0.4);
  show({kR, kB, kB}, 0.4);
  show({kR, kR, kB}, 0.4);
  EXPECT_EQ(identification_.number_of(2), 13);
  EXPECT_EQ(identification_.number_of(1), 12);
  ask(14);
  show({kR, kR, kB}, 0.3);
  show({kR, kR, kR}, 0.7);
  end();
  EXPECT_EQ(identification_.identified(), 2u);
  EXPECT_EQ(identification_.missing(), std::set<std::uint16_t>{14});
  EXPECT_TRUE(identification_.doubtful().empty());
  EXPECT_EQ(identification_.ended(), 1u);
}

TEST_F(Rule, ATrackThatIsAlwaysBlueIsNobody) {
  show({kB, kR}, 0.2);
  for (const std::uint16_t number : {std::uint16_t{3}, std::uint16_t{4}}) {
    ask(number);
    show({kB, kR}, 1);
  }
  end();
  EXPECT_EQ(identification_.identified(), 0u);
  EXPECT_EQ(identification_.missing(), (std::set<std::uint16_t>{3, 4}));
}

TEST_F(Rule, SeveralAnswersAndTwoNumbersOfOneTrackAreInDoubt) {
  ask(1);
  show({kR, kR, kR}, 0.2);
  show({kB, kB, kR}, 1);
  ask(2);
  show({kR, kR, kR}, 0.3);
  show({kR, kR, kB}, 0.5);
  EXPECT_EQ(identification_.number_of(2), 2);
  ask(3);
  show({kR, kR, kR}, 0.3);
  show({kR, kR, kB}, 0.5);
  end();
  EXPECT_EQ(identification_.identified(), 0u);
  EXPECT_EQ(identification_.doubtful(), (std::set<std::uint16_t>{1, 2, 3}));
  // The next identification begins anew.
  ask(2);
  show({kR, kR, kR}, 0.3);
  show({kR, kR, kB}, 0.5);
  end();
  EXPECT_EQ(identification_.number_of(2), 2);
  EXPECT_TRUE(identification_.doubtful().empty());
}

TEST_F(Rule, ANumberBelongsToTheTrackThatAnsweredLastAndGoesWithIt) {
  ask(1);
  show({kR, kR}, 0.2);
  show({kB, kR}, 0.5);
  end();
  ask(1);
  show({kR, kR}, 0.2);
  show({kR, kB}, 0.5);
  end();
  EXPECT_FALSE(identification_.number_of(0));
  EXPECT_EQ(identification_.number_of(1), 1);
  show({kR}, 0.1);
  EXPECT_EQ(identification_.identified(), 0u) << "the track was given up";
}

/// Robots in rendered pictures that answer as ARK's robots do, a quarter of a second late.
class Swarm {
 public:
  Swarm() : renderer_(World(arena()), camera()), tracker_(FloorMap::plane(to_px())) {
    for (std::size_t i = 0; i < places_.size(); ++i)
      places_[i] = {-200.0 + 100 * static_cast<double>((5 * i) % 6), i % 2 == 0 ? -60.0 : 70.0};
  }
  /// Asks, and shows pictures for a second. Robots in `hidden` are not in them.
  void second(std::optional<std::uint16_t> asks, const std::set<std::size_t>& hidden = {}) {
    if (asks) identification_.take(Question{time_s_, *asks == kEnd ? std::nullopt : asks});
    for (int frame = 0; frame < 30; ++frame, time_s_ += kFrame_s) {
      if (asks && frame == 8) shown_ = *asks;
      cameras::Scene scene;
      for (std::size_t i = 0; i < places_.size(); ++i) {
        if (hidden.contains(i)) continue;
        cameras::RobotView view;
        view.robot = static_cast<std::uint32_t>(i);
        view.pose = {places_[i][0], places_[i][1], 0.7 * static_cast<double>(i)};
        const Led led = shown_ == kEnd ? Led::kOff : shown_ == i + kFirst ? Led::kBlue : Led::kRed;
        view.led = bits_of(led);
        scene.robots.push_back(view);
      }
      renderer_.render(scene, frames_++, picture_);
      robots_ = tracker_.process(picture_, time_s_);
      identification_.take(time_s_, robots_, tracker_.follower());
    }
  }
  /// The tracked robot at the place of robot i.
  [[nodiscard]] const TrackedRobot* at(std::size_t i) const {
    for (const TrackedRobot& robot : robots_) {
      if (std::hypot(robot.position.x_mm - places_[i][0], robot.position.y_mm - places_[i][1]) < 5) return &robot;
    }
    return nullptr;
  }
  void exchange(std::size_t i, std::size_t j) { std::swap(places_[i], places_[j]); }
  void move(std::size_t i, double x_mm, double y_mm) { places_[i] = {x_mm, y_mm}; }
  [[nodiscard]] std::size_t robots() const { return places_.size(); }
  [[nodiscard]] const Identification& identification() const { return identification_; }

  static constexpr std::uint16_t kEnd = 0xffff, kFirst = 40;

 private:
  static constexpr double kPx_per_mm = 0.9;
  static constexpr int kWidth_px = 600, kHeight_px = 400;
  static proto::Experiment arena() {
    proto::Experiment experiment;
    experiment.mutable_arena()->set_width_mm(640);
    experiment.mutable_arena()->set_height_mm(420);
    return experiment;
  }
  static cameras::CameraModel camera() {
    cameras::CameraModel camera = cameras::CameraModel::overhead(kWidth_px, kHeight_px, kPx_per_mm);
    camera.read_noise = 3;
    camera.uneven_light = 0.3;
    camera.blur_px = 0.7;
    return camera;
  }
  static cv::Matx33d to_px() {
    return {kPx_per_mm, 0, 0.5 * (kWidth_px - 1), 0, -kPx_per_mm, 0.5 * (kHeight_px - 1), 0, 0, 1};
  }

  std::array<std::array<double, 2>, 6> places_{};
  std::uint16_t shown_ = kEnd;
  double time_s_ = 0;
  std::uint64_t frames_ = 0;
  cameras::Renderer renderer_;
  PictureTracker tracker_;
  Identification identification_;
  cv::Mat picture_;
  std::vector<TrackedRobot> robots_;
};

TEST(IdentificationOnPictures, RobotsGetTheirNumbersAndKeepThem) {
  Swarm swarm;
  swarm.second({});
  for (std::uint16_t i = 0; i < swarm.robots(); ++i) swarm.second(Swarm::kFirst + i);
  swarm.second(Swarm::kEnd);
  EXPECT_EQ(swarm.identification().identified(), swarm.robots());
  const auto expect_right = [&] {
    for (std::size_t i = 0; i < swarm.robots(); ++i) {
      const TrackedRobot* const robot = swarm.at(i);
      ASSERT_NE(robot, nullptr) << i;
      EXPECT_EQ(robot->number, Swarm::kFirst + i);
      EXPECT_EQ(robot->state, TrackState::kSeen);
    }
  };
  expect_right();
}

TEST(IdentificationOnPictures, ExchangedRobotsAreInDoubtUntilTheyAreAskedAgain) {
  Swarm swarm;
  swarm.move(1, -182, -60);
  swarm.move(0, -218, -60);
  swarm.second({});
  for (std::uint16_t i = 0; i < swarm.robots(); ++i) swarm.second(Swarm::kFirst + i);
  swarm.second(Swarm::kEnd);
  ASSERT_EQ(swarm.identification().identified(), swarm.robots());
  // Both vanish under a hand and come back: either may be either.
  swarm.second({}, {0, 1});
  swarm.second({}, {0, 1});
  swarm.move(0, -200, -78);
  swarm.move(1, -200, -42);
  swarm.second({});
  for (const std::size_t i : {std::size_t{0}, std::size_t{1}}) {
    ASSERT_NE(swarm.at(i), nullptr);
    EXPECT_EQ(swarm.at(i)->state, TrackState::kDoubt) << i;
  }
  for (std::size_t i = 2; i < swarm.robots(); ++i) EXPECT_EQ(swarm.at(i)->state, TrackState::kSeen) << i;
  swarm.second(Swarm::kFirst + 1);
  swarm.second(Swarm::kFirst);
  swarm.second(Swarm::kEnd);
  swarm.second({});
  for (std::size_t i = 0; i < swarm.robots(); ++i) {
    EXPECT_EQ(swarm.at(i)->number, Swarm::kFirst + i) << i;
    EXPECT_EQ(swarm.at(i)->state, TrackState::kSeen) << i;
  }
}

}  // namespace
}  // namespace kilotwin::track
