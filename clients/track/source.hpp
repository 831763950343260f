/// Where pictures come from: a picture, a video file, a directory of pictures, a camera, a network stream.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <thread>

namespace kilotwin::track {

struct CapturedFrame {
  cv::Mat picture;
  std::uint64_t number = 0;     ///< counts the source's frames from 0, dropped ones included
  double time_s = 0;            ///< since the first frame; of what the picture shows: capture_clock.hpp
  std::int64_t capture_ns = 0;  ///< steady clock, when the frame arrived from a live source; 0 for files
};

class Source {
 public:
  virtual ~Source() = default;
  /// The next frame; nothing at the end, or when `stop` turned true. Throws RunError where the source fails.
  [[nodiscard]] virtual std::optional<CapturedFrame> next(const std::atomic<bool>& stop) = 0;
  /// Whether frames come by themselves: a reader that is slow misses some.
  [[nodiscard]] virtual bool live() const = 0;
};

struct SourceOptions {
  double rate_hz = 30;          ///< of a directory of pictures, and of a video file without one of its own
  bool watch = false;           ///< a directory grows, or a picture is replaced again and again: wait for new ones
  std::optional<int> camera{};  ///< whose pictures of an ARK directory, frame_%05d_%d.jpg; none: camera 0
};

/// By what `place` is: digits: a camera's index; with "://": a stream; else a file or a directory. Throws UserError where there
/// is no such thing, or where it cannot be read.
[[nodiscard]] std::unique_ptr<Source> open_source(const std::string& place, const SourceOptions& options);

/// Reads a source on a thread of its own. Of a live source the newest frames are kept and others dropped, which is counted;
/// other sources wait.
class FrameQueue {
 public:
  explicit FrameQueue(std::unique_ptr<Source> source);
  ~FrameQueue();
  FrameQueue(const FrameQueue&) = delete;
  FrameQueue& operator=(const FrameQueue&) = delete;

  /// Waits for the next frame; nothing at the end, or when `stopped` says so. Rethrows what the source threw.
  [[nodiscard]] std::optional<CapturedFrame> next(const std::function<bool()>& stopped = [] { return false; });
  /// The next call of next() yields nothing, waiting or not. Safe to call from any thread.
  void stop();
  [[nodiscard]] std::uint64_t dropped() const { return dropped_.load(); }

 private:
  static constexpr std::size_t kRoom = 2;
  void read();

  std::unique_ptr<Source> source_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<CapturedFrame> frames_;
  std::atomic<bool> stop_{false};
  std::atomic<std::uint64_t> dropped_{0};
  bool ended_ = false;
  std::exception_ptr error_;
  std::thread thread_;
};

}  // namespace kilotwin::track
