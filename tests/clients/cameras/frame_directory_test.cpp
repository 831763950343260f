// The directory against a reader that behaves as ARK does: it reads frames upward, opens each file more than once, waits for
// missing ones, and starts again at frame 0.
#include "clients/cameras/frame_directory.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <set>
#include <sstream>
#include <thread>

#include "core/base/error.hpp"
#include "tests/system/program.hpp"

namespace kilotwin::cameras {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr std::uint32_t kCameras = 4;

/// The writer's side: pictures are texts that say which set they belong to.
class Writer {
 public:
  explicit Writer(const fs::path& directory) : frames_(directory, kCameras) {}
  /// One turn of the loop; true where a set was written.
  bool turn() {
    frames_.look();
    if (!frames_.wants_pictures()) return false;
    ++set_;
    std::vector<std::string> pictures;
    for (std::uint32_t camera = 0; camera < kCameras; ++camera)
      pictures.push_back(fmt::format("{} {}", set_, camera));
    frames_.put(std::move(pictures));
    return true;
  }
  [[nodiscard]] int newest() const { return set_; }

 private:
  FrameDirectory frames_;
  int set_ = 0;
};

/// The set that a file shows; nothing where there is no file. Opened twice, as image libraries do.
std::optional<int> read_frame(const fs::path& directory, std::uint32_t frame, std::uint32_t camera) {
  const fs::path path = directory / fmt::format("frame_{:05}_{}.jpg", frame, camera);
  if (!std::ifstream(path)) return std::nullopt;
  std::ifstream file(path);
  int set = 0;
  std::uint32_t of = kCameras;
  if (!(file >> set >> of)) ADD_FAILURE() << path << " is not whole";
  EXPECT_EQ(of, camera);
  return set;
}

std::size_t files_in(const fs::path& directory) {
  std::size_t count = 0;
  for (const auto& entry : fs::directory_iterator(directory)) count += entry.path().extension() == ".jpg" ? 1u : 0u;
  return count;
}

TEST(FrameDirectory, AReaderThatGoesUpSeesOneInstantPerFrameAndNothingOld) {
  const test::Scratch scratch;
  Writer writer(scratch.path());
  int last = 0;
  for (std::uint32_t frame = 0; frame < 30; ++frame) {
    std::set<int> sets;
    for (std::uint32_t camera = 0; camera < kCameras; ++camera) {
      std::optional<int> set;
      ASSERT_TRUE(test::eventually([&] {
        writer.turn();
        set = read_frame(scratch.path(), frame, camera);
        return set.has_value();
      })) << "frame "
          << frame;
      sets.insert(*set);
    }
    EXPECT_EQ(sets.size(), 1u) << "frame " << frame << " mixes instants";
    EXPECT_GE(*sets.begin(), last);
    EXPECT_GE(*sets.begin(), writer.newest() - static_cast<int>(kCameras)) << "frame " << frame << " is old";
    last = *sets.begin();
    EXPECT_LE(files_in(scratch.path()), 3 * kCameras + kCameras);
  }
}

TEST(FrameDirectory, ANewStartSeesTheArenaAsItIs) {
  const test::Scratch scratch;
  Writer writer(scratch.path());
  for (const std::uint32_t frames : {2u, 7u, 1u, 3u}) {
    // One phase: `frames` frames of all cameras, from 0.
    int first = -1;
    const int before = writer.newest();
    for (std::uint32_t frame = 0; frame < frames; ++frame) {
      for (std::uint32_t camera = 0; camera < kCameras; ++camera) {
        std::optional<int> set;
        ASSERT_TRUE(test::eventually([&] {
          writer.turn();
          set = read_frame(scratch.path(), frame, camera);
          return set.has_value();
        }));
        if (first < 0) first = *set;
        EXPECT_GE(*set, first) << "frame " << frame << " is of an earlier phase";
      }
    }
    EXPECT_GE(first, before - 1) << "frame 0 is of an earlier phase";
    // The station thinks; meanwhile pictures go on, and what it will find is replaced by newer ones: the frame that it read
    // last only 500 ms later, and pictures may follow each other at 250 ms, the first of them at once.
    const int after = writer.newest();
    ASSERT_TRUE(test::eventually([&] {
      writer.turn();
      return writer.newest() >= after + 4;
    }));
  }
}

TEST(FrameDirectory, ReadersOfSingleCamerasMayRunAhead) {
  const test::Scratch scratch;
  Writer writer(scratch.path());
  // Camera 2 is two frames ahead of the others, as with a buffer of two.
  const auto read_one = [&](std::uint32_t frame, std::uint32_t camera) {
    std::optional<int> set;
    EXPECT_TRUE(test::eventually([&] {
      writer.turn();
      set = read_frame(scratch.path(), frame, camera);
      return set.has_value();
    }));
    return set.value_or(-1);
  };
  for (std::uint32_t frame = 0; frame < 12; ++frame) {
    read_one(frame, 2);
    if (frame < 2) continue;
    for (const std::uint32_t camera : {0u, 1u, 3u}) read_one(frame - 2, camera);
  }
}

TEST(FrameDirectory, FramesOfOthersAreNotReplaced) {
  const test::Scratch scratch;
  test::write(scratch.path() / "frame_00007_2.jpg", "a video");
  EXPECT_THROW(FrameDirectory(scratch.path(), kCameras), UserError);
  EXPECT_EQ(test::read(scratch.path() / "frame_00007_2.jpg"), "a video");
}

TEST(FrameDirectory, ItsOwnFramesOfAnEarlierTimeAreRemoved) {
  const test::Scratch scratch;
  {
    Writer writer(scratch.path());
    EXPECT_TRUE(writer.turn());
  }
  EXPECT_GT(files_in(scratch.path()), 0u);
  const FrameDirectory again(scratch.path(), kCameras);
  EXPECT_EQ(files_in(scratch.path()), 0u);
}

}  // namespace
}  // namespace kilotwin::cameras
