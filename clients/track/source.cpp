#include "clients/track/source.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <utility>
#include <vector>

#include "clients/track/capture_clock.hpp"
#include "core/base/error.hpp"

namespace kilotwin::track {
namespace fs = std::filesystem;
namespace {

bool is_picture(const fs::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(c >= 'A' && c <= 'Z' ? c + 32 : c); });
  return extension == ".jpg" || extension == ".jpeg" || extension == ".png" || extension == ".bmp" ||
         extension == ".tif" || extension == ".tiff" || extension == ".ppm" || extension == ".pgm";
}

/// Pictures in the order of their names.
class PictureFiles : public Source {
 public:
  PictureFiles(std::vector<fs::path> files, double rate_hz) : files_(std::move(files)), rate_hz_(rate_hz) {}
  std::optional<CapturedFrame> next(const std::atomic<bool>&) override {
    if (at_ >= files_.size()) return std::nullopt;
    CapturedFrame frame{cv::imread(files_[at_].string(), cv::IMREAD_COLOR), at_,
                        static_cast<double>(at_) / rate_hz_, 0};
    if (frame.picture.empty())
      throw UserError(fmt::format("{}: is no picture that can be read; PNG and JPEG can", files_[at_].string()));
    ++at_;
    return frame;
  }
  [[nodiscard]] bool live() const override { return false; }

 private:
  std::vector<fs::path> files_;
  double rate_hz_;
  std::size_t at_ = 0;
};

/// A directory that grows. Its writer renames whole files into it.
class GrowingDirectory : public Source {
 public:
  GrowingDirectory(fs::path directory, std::string suffix)
      : directory_(std::move(directory)), suffix_(std::move(suffix)) {}
  std::optional<CapturedFrame> next(const std::atomic<bool>& stop) override {
    while (!stop) {
      if (waiting_.empty()) look();
      while (!waiting_.empty()) {
        const fs::path file = waiting_.front();
        waiting_.pop_front();
        const auto [picture, stamp] = read_stamped(file);
        if (picture.empty()) continue;
        CapturedFrame frame{picture, number_++, 0, 0};
        clock_.time(frame, stamp);
        return frame;
      }
      constexpr std::chrono::milliseconds kPause{4};
      std::this_thread::sleep_for(kPause);
    }
    return std::nullopt;
  }
  [[nodiscard]] bool live() const override { return true; }

 private:
  void look() {
    std::vector<fs::path> files;
    std::error_code error;
    for (const fs::directory_entry& entry : fs::directory_iterator(directory_, error)) {
      const fs::path& file = entry.path();
      if (is_picture(file) && file.filename().string().ends_with(suffix_) && file.filename().string() > last_)
        files.push_back(file);
    }
    if (error) throw RunError(fmt::format("{}: cannot be read: {}", directory_.string(), error.message()));
    std::sort(files.begin(), files.end());
    if (!files.empty()) last_ = files.back().filename().string();
    waiting_.assign(files.begin(), files.end());
  }

  fs::path directory_;
  std::string suffix_, last_;
  std::deque<fs::path> waiting_;
  std::uint64_t number_ = 0;
  CaptureClock clock_;
};

/// One file that is replaced by each new picture.
class RewrittenPicture : public Source {
 public:
  explicit RewrittenPicture(fs::path file) : file_(std::move(file)) {}
  std::optional<CapturedFrame> next(const std::atomic<bool>& stop) override {
    while (!stop) {
      if (is_new()) {
        const auto [picture, stamp] = read_stamped(file_);
        if (!picture.empty() && (!stamp || !last_stamp_ns_ || stamp->capture_ns > *last_stamp_ns_)) {
          CapturedFrame frame{picture, number_++, 0, 0};
          clock_.time(frame, stamp);
          if (stamp) last_stamp_ns_ = stamp->capture_ns;
          return frame;
        }
      }
      constexpr std::chrono::milliseconds kPause{2};
      std::this_thread::sleep_for(kPause);
    }
    return std::nullopt;
  }
  [[nodiscard]] bool live() const override { return true; }

 private:
  bool is_new() {
    std::error_code none;
    const fs::file_time_type written = fs::last_write_time(file_, none);
    return !none && std::exchange(written_, written) != written;
  }

  fs::path file_;
  fs::file_time_type written_{};
  std::uint64_t number_ = 0;
  CaptureClock clock_;
  std::optional<std::int64_t> last_stamp_ns_;
};

class Video : public Source {
 public:
  Video(const cv::VideoCapture& capture, bool live, double rate_hz) : capture_(capture), live_(live) {
    const double stated = capture_.get(cv::CAP_PROP_FPS);
    rate_hz_ = stated > 0.1 && stated < 1000 ? stated : rate_hz;
  }
  std::optional<CapturedFrame> next(const std::atomic<bool>&) override {
    if (!capture_.grab()) return std::nullopt;
    CapturedFrame frame{cv::Mat(), number_, static_cast<double>(number_) / rate_hz_, 0};
    if (live_) clock_.time(frame, std::nullopt);
    if (!capture_.retrieve(frame.picture) || frame.picture.empty()) return std::nullopt;
    ++number_;
    return frame;
  }
  [[nodiscard]] bool live() const override { return live_; }

 private:
  cv::VideoCapture capture_;
  bool live_;
  double rate_hz_;
  std::uint64_t number_ = 0;
  CaptureClock clock_;
};

std::unique_ptr<Source> open_directory(const fs::path& place, const SourceOptions& options) {
  std::vector<fs::path> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(place)) {
    if (is_picture(entry.path())) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  // ARK's directories hold the pictures of four cameras.
  const std::string suffix = fmt::format("_{}.jpg", options.camera.value_or(0));
  const bool ark = std::any_of(files.begin(), files.end(), [](const fs::path& file) {
    const std::string name = file.filename().string();
    return name.starts_with("frame_") && name.size() == 17 && name[11] == '_' && name.ends_with(".jpg");
  });
  if (options.watch) return std::make_unique<GrowingDirectory>(place, ark ? suffix : std::string());
  if (ark) std::erase_if(files, [&](const fs::path& file) { return !file.filename().string().ends_with(suffix); });
  if (files.empty())
    throw UserError(
        fmt::format("{}: holds no pictures; expected *.png or *.jpg, or --watch to wait for them", place.string()));
  return std::make_unique<PictureFiles>(std::move(files), options.rate_hz);
}

}  // namespace

std::unique_ptr<Source> open_source(const std::string& place, const SourceOptions& options) {
  std::error_code ignored;
  const bool index = !place.empty() && place.size() < 4 &&
                     std::all_of(place.begin(), place.end(), [](char c) { return c >= '0' && c <= '9'; });
  if (index || place.find("://") != std::string::npos) {
    cv::VideoCapture capture;
    const bool open = index ? capture.open(std::stoi(place)) : capture.open(place);
    if (!open) throw UserError(fmt::format("{}: no camera or stream can be opened there", place));
    return std::make_unique<Video>(std::move(capture), true, options.rate_hz);
  }
  if (fs::is_directory(place, ignored)) return open_directory(place, options);
  if (options.watch && is_picture(place)) return std::make_unique<RewrittenPicture>(place);
  if (!fs::exists(place, ignored))
    throw UserError(fmt::format(
        "{}: does not exist; expected a picture, a video, a directory of pictures, a camera's index or a "
        "stream's URL",
        place));
  if (is_picture(place)) return std::make_unique<PictureFiles>(std::vector<fs::path>{place}, options.rate_hz);
  cv::VideoCapture capture;
  if (!capture.open(place))
    throw UserError(fmt::format("{}: is neither a picture nor a video that can be read", place));
  return std::make_unique<Video>(std::move(capture), false, options.rate_hz);
}

FrameQueue::FrameQueue(std::unique_ptr<Source> source) : source_(std::move(source)), thread_([this] { read(); }) {}

FrameQueue::~FrameQueue() {
  stop();
  thread_.join();
}

void FrameQueue::stop() {
  stop_ = true;
  changed_.notify_all();
}

void FrameQueue::read() {
  try {
    while (!stop_) {
      std::optional<CapturedFrame> frame = source_->next(stop_);
      if (!frame) break;
      std::unique_lock lock(mutex_);
      if (source_->live()) {
        if (frames_.size() >= kRoom) {
          frames_.pop_front();
          ++dropped_;
        }
      } else {
        changed_.wait(lock, [this] { return stop_ || frames_.size() < kRoom; });
      }
      frames_.push_back(std::move(*frame));
      changed_.notify_all();
    }
  } catch (...) {
    const std::lock_guard lock(mutex_);
    error_ = std::current_exception();
  }
  const std::lock_guard lock(mutex_);
  ended_ = true;
  changed_.notify_all();
}

std::optional<CapturedFrame> FrameQueue::next(const std::function<bool()>& stopped) {
  std::unique_lock lock(mutex_);
  // The state that `stopped` reads changes without a wake-up.
  constexpr std::chrono::milliseconds kLook{50};
  while (!stop_ && !stopped() && frames_.empty() && !ended_) changed_.wait_for(lock, kLook);
  if (stop_ || stopped()) return std::nullopt;
  if (frames_.empty()) {
    if (error_) std::rethrow_exception(error_);
    return std::nullopt;
  }
  CapturedFrame frame = std::move(frames_.front());
  frames_.pop_front();
  changed_.notify_all();
  return frame;
}

}  // namespace kilotwin::track
