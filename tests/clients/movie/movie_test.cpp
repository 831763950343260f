#include "clients/movie/movie.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>
#include <string>
#include <vector>

#include "clients/movie/encoder.hpp"
#include "clients/movie/rasteriser.hpp"
#include "core/base/error.hpp"
#include "tests/clients/recorder/synthetic.hpp"

namespace kilotwin::movie {
namespace {

using recorder::Scratch;

constexpr double kTick_s = 262144 / 8e6;
constexpr std::uint8_t kRed = 3;

/// A red robot that walks 100 mm to the right every ten ticks, one state per ten ticks.
std::filesystem::path walk(const Scratch& scratch, int states) {
  const std::filesystem::path file = scratch / "walk.ktrec";
  recorder::Writer writer(file, recorder::synthetic_header(1));
  for (int k = 0; k < states; ++k) {
    const std::vector<double> x{-400.0 + 100 * k}, y{0}, heading{0};
    const std::vector<std::uint8_t> led{kRed}, life{4};
    writer.state({Tick{10 * k}, x, y, heading, led, life, {}, {}, {}});
  }
  writer.end(Tick{10 * (states - 1)}, 0);
  return file;
}

/// A movie whose frames fall on the recorded states, and on the middles between them.
Movie movie_of(const std::filesystem::path& file) {
  Movie movie;
  movie.file = file;
  movie.frames_per_s = 20;
  movie.times_real = 5 * kTick_s * movie.frames_per_s;
  movie.look.trail_s = 0;
  movie.look.whole_arena = true;
  return movie;
}

/// The centre of all pixels that are clearly red; x is negative where there are none.
cv::Point2d red_centre(const cv::Mat& picture) {
  cv::Point2d sum{0, 0};
  int count = 0;
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) {
      const std::uint8_t* const pixel = picture.ptr(y, x);
      if (pixel[2] < 150 || pixel[2] < pixel[0] + 90 || pixel[2] < pixel[1] + 90) continue;
      sum += cv::Point2d(x, y);
      ++count;
    }
  }
  return count == 0 ? cv::Point2d(-1, -1) : sum / count;
}

std::vector<cv::Mat> frames_of(const std::filesystem::path& file) {
  cv::VideoCapture video(file.string());
  std::vector<cv::Mat> frames;
  for (cv::Mat frame; video.read(frame);) frames.push_back(frame.clone());
  return frames;
}

class Movies : public testing::TestWithParam<const char*> {};

TEST_P(Movies, ShowTheRobotWhereItWas) {
  const Scratch scratch;
  Movie movie = movie_of(scratch / (std::string("walk") + GetParam()));
  const Made made = make_movie(walk(scratch, 5), movie, {});
  EXPECT_EQ(made.frames, 9u);
  const std::vector<cv::Mat> frames = frames_of(movie.file);
  ASSERT_EQ(frames.size(), 9u);
  // The arena, 2000 mm x 1000 mm and 1 % of the longer side around it, fills the panel.
  const double px_per_mm = std::min(1240.0 / 2040, (720.0 - 62 - 56) / 1040);
  const cv::Point2d first = red_centre(frames[0]);
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const cv::Point2d centre = red_centre(frames[k]);
    EXPECT_NEAR(centre.x - first.x, 50 * static_cast<double>(k) * px_per_mm, 1.5) << "frame " << k;
    EXPECT_NEAR(centre.y, first.y, 1.0) << "frame " << k;
  }
  EXPECT_NEAR(first.x, 640 - 400 * px_per_mm, 6.0);
}
INSTANTIATE_TEST_SUITE_P(Formats, Movies, testing::Values(".mp4", ".webm", ".gif"));

TEST(Movie, IsTheSameFileEachTime) {
  const Scratch scratch;
  const std::filesystem::path recording = walk(scratch, 3);
  for (const std::uint32_t threads : {1u, 3u}) {
    Movie movie = movie_of(scratch / (std::to_string(threads) + ".mp4"));
    movie.threads = threads;
    (void)make_movie(recording, movie, {});
  }
  EXPECT_EQ(recorder::content(scratch / "1.mp4"), recorder::content(scratch / "3.mp4"));
  EXPECT_FALSE(recorder::content(scratch / "1.mp4").empty());
}

TEST(Movie, ShowsAPartOfTheRun) {
  const Scratch scratch;
  Movie movie = movie_of(scratch / "part.mp4");
  movie.from_s = 10 * kTick_s;
  movie.to_s = 20 * kTick_s + 1e-6;
  EXPECT_EQ(make_movie(walk(scratch, 5), movie, {}).frames, 3u);
}

TEST(Movie, OfALongRunIsFaster) {
  const Scratch scratch;
  Movie movie = movie_of(scratch / "long.mp4");
  movie.times_real.reset();
  movie.frames_per_s = 1;
  const Made made = make_movie(walk(scratch, 400), movie, {});  // 131 s
  EXPECT_EQ(made.times_real, 5);
  EXPECT_NEAR(made.duration_s, 399 * 10 * kTick_s / 5, 1);
}

TEST(Movie, NamesTheErrorThatKeepsItFromBeingWritten) {
  const Scratch scratch;
  const std::filesystem::path recording = walk(scratch, 3);
  try {
    (void)make_movie(recording, movie_of(scratch / "no such folder" / "walk.mp4"), {});
    FAIL();
  } catch (const RunError& error) {
    EXPECT_NE(std::string(error.what()).find("No such file"), std::string::npos) << error.what();
  }
  Movie late = movie_of(scratch / "late.mp4");
  late.from_s = 1000;
  EXPECT_THROW((void)make_movie(recording, late, {}), UserError);
}

TEST(MovieTrails, ReachBackAsFarAsAsked) {
  Trails trails(2);
  recorder::Snapshot at;
  at.y_mm = {0};
  for (int k = 0; k <= 1000; ++k) {
    at.time_s = 0.01 * k;
    at.x_mm = {at.time_s};
    trails.add(at);
  }
  EXPECT_GE(trails.positions().front().time_s, 8 - 1e-9);
  EXPECT_LT(trails.positions().front().time_s, 8.1);
  EXPECT_LE(trails.positions().size(), 81u);
  Trails none(0);
  none.add(at);
  EXPECT_TRUE(none.positions().empty());
}

TEST(MovieTrails, LeadThroughWhereTheRobotWas) {
  const Scratch scratch;
  const std::filesystem::path file = walk(scratch, 2);
  recorder::Reader reader(file);
  const recorder::RunOverview run = recorder::read_overview(reader);
  Look look;
  look.whole_arena = true;
  const FrameArtist artist(run, look);
  Trails trails(10);
  recorder::Snapshot at = run.paths.first();
  for (int k = 0; k <= 2; ++k) {
    at.time_s = k;
    at.x_mm = {-200.0 + 200 * k};
    at.y_mm = {-100.0 + 100 * k};
    trails.add(at);
  }
  // The arena's centre lies at (6200, 3010), in tenths of a pixel. y points down on paper.
  const double units_per_mm = 10 * std::min(1240.0 / 2040, (720.0 - 62 - 56) / 1040);
  std::string path;
  for (const Positions& was : trails.positions()) {
    path += (path.empty() ? "M" : "L") + std::to_string(std::lround(6200 + was.points[0].x_mm * units_per_mm)) +
            " " + std::to_string(std::lround(3010 - was.points[0].y_mm * units_per_mm));
  }
  EXPECT_NE(artist.svg(at, {}, trails.positions()).find("\"" + path + "\""), std::string::npos)
      << path << "\n"
      << artist.svg(at, {}, trails.positions());
}

TEST(MovieFormat, FollowsTheName) {
  EXPECT_EQ(format_of("a.b/run.mp4"), Format::kMp4);
  EXPECT_EQ(format_of("run.webm"), Format::kWebm);
  EXPECT_EQ(format_of("run.gif"), Format::kGif);
  EXPECT_EQ(format_of("run.avi"), std::nullopt);
  EXPECT_EQ(format_of("mp4"), std::nullopt);
}

TEST(Rasteriser, DrawsTheElementsOfTheText) {
  const std::vector<std::uint8_t> picture = rasterised(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"4\" height=\"2\"><rect width=\"2\" height=\"2\" "
      "fill=\"#010203\"/></svg>",
      4, 2);
  ASSERT_EQ(picture.size(), 4u * 2 * 4);
  EXPECT_EQ(picture[0], 3);
  EXPECT_EQ(picture[1], 2);
  EXPECT_EQ(picture[2], 1);
  EXPECT_EQ(picture[3 * 4 + 2], 0);
  EXPECT_THROW((void)rasterised("no picture", 4, 2), RunError);
}

}  // namespace
}  // namespace kilotwin::movie
