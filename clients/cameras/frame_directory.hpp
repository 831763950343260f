/// FrameDirectory: a plain directory that a station reads as if it were four cameras: frame_%05d_%d.jpg (frame, camera).
///
/// A station reads frames in ascending order from 0, waits for a file that is missing, and returns to frame 0 whenever it changes
/// its mode. The directory follows the reader, so that the station sees the present state of the arena: inotify reports which file
/// the station opens.
///
///   - The directory holds three frames of each camera: frame 0, the frame that was opened last, and the next one.
///   - A file that has not been opened for a while is replaced by a newer picture, by rename. So frame 0 and the next frame are
///     always recent.
///   - While a file of a frame is being read, the frame stays unchanged for all cameras, so that its pictures show one instant.
///   - If a reader opens a camera's frame 0 again, that camera's later frames are removed.
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

  /// Processes the events since the last call.
  void look();
  /// Waits until a file is opened, or until `patience` has passed.
  void wait(std::chrono::milliseconds patience) const;
  /// Whether put() would write anything: a file is missing, or a file that may be read next is old.
  [[nodiscard]] bool wants_pictures() const;
  /// Writes new pictures, one JPEG per camera, to all files that may be replaced.
  void put(std::vector<std::string> pictures);

  /// Number of the camera's frame that was opened last; 0 before the first.
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
