/// FrameDirectory: a plain directory that a station reads as if it were four cameras: frame_%05d_%d.jpg (frame, camera).
///
/// Such a reader goes up from frame 0, waits for a file that is missing, and starts at frame 0 again whenever it changes its
/// mode. So that it sees the arena as it is, the directory follows the reader: the kernel says which file is opened (inotify).
///
///   - Of each camera there are the frame 0, the frame that was opened last, and the one after it. All others are removed.
///   - Files that nobody has opened of late are replaced by newer pictures, by rename. Frame 0 is fresh for a new start, and the
///     next frame is never old.
///   - While one camera's frame is being read, the frame of that number stays for all cameras: together they show one instant.
///   - A camera whose frame 0 is opened after others starts again: its later frames are removed.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/os/descriptor.hpp"

namespace kilotwin::cameras {

class FrameDirectory {
 public:
  using Clock = std::chrono::steady_clock;

  /// Makes the directory. Throws UserError where it holds frames that no FrameDirectory wrote, RunError where it cannot be
  /// written or watched.
  FrameDirectory(std::filesystem::path directory, std::uint32_t cameras);

  /// Takes notice of what was opened since the last call.
  void look();
  /// Waits until a file is opened, `patience` at most.
  void wait(std::chrono::milliseconds patience) const;
  /// Whether new pictures are of use: a file is missing, or one that may be read next is old.
  [[nodiscard]] bool wants_pictures() const;
  /// New pictures, one per camera, encoded: they become the content of all files that may be replaced.
  void put(std::vector<std::string> pictures);

  /// The frame that was opened last, of a camera; 0 at first.
  [[nodiscard]] std::uint32_t opened(std::uint32_t camera) const { return opened_.at(camera); }

 private:
  using Set = std::shared_ptr<const std::vector<std::string>>;
  struct Frame {
    Set content;                  // of all cameras
    std::vector<bool> there;      // per camera: its file has this content
    Clock::time_point written{};  // the content's age
    Clock::time_point touched{};  // when a file of it was opened or closed last
  };
  void on_event(const std::string& name, bool opens);
  void advance(std::uint32_t camera, std::uint32_t frame);
  void drop(std::uint32_t camera, std::uint32_t frame);
  [[nodiscard]] bool needed(std::uint32_t camera, std::uint32_t frame) const;
  [[nodiscard]] bool being_read(const Frame& frame) const;
  [[nodiscard]] std::filesystem::path path_of(std::uint32_t frame, std::uint32_t camera) const;
  void write(std::uint32_t frame, std::uint32_t camera, const std::string& picture);

  std::filesystem::path directory_;
  os::Descriptor watch_;
  std::vector<std::uint32_t> opened_;  // per camera
  std::map<std::uint32_t, Frame> frames_;
};

}  // namespace kilotwin::cameras
