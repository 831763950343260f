#include "clients/cameras/frame_directory.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <optional>
#include <set>
#include <string_view>

#include "core/base/error.hpp"
#include "core/os/files.hpp"

namespace kilotwin::cameras {
namespace fs = std::filesystem;
namespace {

/// A directory of ours has this file.
constexpr const char* kMark = ".kilotwin-cameras";
/// A file that was opened or closed so recently may still be read.
constexpr auto kReading = std::chrono::milliseconds(500);
/// The oldest picture that a reader may find.
constexpr auto kOldest = std::chrono::milliseconds(250);

struct FrameName {
  std::uint32_t frame, camera;
};

/// frame_TTTTT_C.jpg, five digits and one.
std::optional<FrameName> parsed(std::string_view name) {
  constexpr std::string_view kBegins = "frame_", kEnds = ".jpg";
  constexpr std::size_t kFrameDigits = 5, kCameraAt = kBegins.size() + kFrameDigits + 1;
  if (name.size() != kCameraAt + 1 + kEnds.size() || !name.starts_with(kBegins) || !name.ends_with(kEnds) ||
      name[kCameraAt - 1] != '_')
    return std::nullopt;
  FrameName parts{};
  const auto number = [](std::string_view digits, std::uint32_t& value) {
    const char* const last = digits.data() + digits.size();
    const auto [end, error] = std::from_chars(digits.data(), last, value);
    return error == std::errc() && end == last;
  };
  if (!number(name.substr(kBegins.size(), kFrameDigits), parts.frame) ||
      !number(name.substr(kCameraAt, 1), parts.camera))
    return std::nullopt;
  return parts;
}

}  // namespace

FrameDirectory::FrameDirectory(fs::path directory, std::uint32_t cameras)
    : directory_(std::move(directory)), opened_(cameras, 0) {
  std::error_code error;
  fs::create_directories(directory_, error);
  if (error) throw RunError(fmt::format("{}: cannot be made: {}", directory_.string(), error.message()));
  std::vector<fs::path> frames;
  for (const fs::directory_entry& entry : fs::directory_iterator(directory_)) {
    if (parsed(entry.path().filename().string())) frames.push_back(entry.path());
  }
  if (!frames.empty() && !fs::exists(directory_ / kMark))
    throw UserError(fmt::format(
        "{}: holds frames that kilotwin cameras has not written; choose another directory, so that they "
        "are not replaced",
        directory_.string()));
  for (const fs::path& frame : frames) fs::remove(frame);
  os::write_file(directory_ / kMark, "kilotwin cameras replaces frame_*.jpg in this directory\n");
  watch_.reset(inotify_init1(IN_NONBLOCK | IN_CLOEXEC));
  if (watch_.get() < 0 || inotify_add_watch(watch_.get(), directory_.c_str(), IN_OPEN | IN_CLOSE_NOWRITE) < 0)
    throw RunError(fmt::format("{}: cannot be watched: {}", directory_.string(), os::system_reason()));
}

void FrameDirectory::look() {
  alignas(inotify_event) std::array<char, 16384> buffer;
  for (;;) {
    const ssize_t length = read(watch_.get(), buffer.data(), buffer.size());
    if (length <= 0) return;
    for (std::size_t at = 0; at < static_cast<std::size_t>(length);) {
      inotify_event event{};
      std::memcpy(&event, buffer.data() + at, sizeof event);
      if (event.len > 0) on_event(buffer.data() + at + sizeof event, (event.mask & IN_OPEN) != 0);
      at += sizeof event + event.len;
    }
  }
}

void FrameDirectory::wait(std::chrono::milliseconds patience) const {
  pollfd waiting{watch_.get(), POLLIN, 0};
  poll(&waiting, 1, static_cast<int>(patience.count()));
}

void FrameDirectory::on_event(const std::string& name, bool opens) {
  const std::optional<FrameName> file = parsed(name);
  if (!file || file->camera >= opened_.size()) return;
  const auto found = frames_.find(file->frame);
  if (found == frames_.end()) return;
  found->second.touched = Clock::now();
  if (opens && file->frame != opened_[file->camera]) advance(file->camera, file->frame);
}

/// The reader of a camera has gone on, or starts again.
void FrameDirectory::advance(std::uint32_t camera, std::uint32_t frame) {
  opened_[camera] = frame;
  std::vector<std::uint32_t> dropped;
  for (const auto& [number, one] : frames_) {
    if (one.there[camera] && !needed(camera, number)) dropped.push_back(number);
  }
  for (const std::uint32_t number : dropped) drop(camera, number);
}

void FrameDirectory::drop(std::uint32_t camera, std::uint32_t frame) {
  Frame& of = frames_.at(frame);
  of.there[camera] = false;
  std::error_code gone_already;
  fs::remove(path_of(frame, camera), gone_already);
  if (std::none_of(of.there.begin(), of.there.end(), [](bool there) { return there; })) frames_.erase(frame);
}

bool FrameDirectory::needed(std::uint32_t camera, std::uint32_t frame) const {
  return frame == 0 || frame == opened_[camera] || frame == opened_[camera] + 1;
}

bool FrameDirectory::being_read(const Frame& frame) const {
  return frame.touched != Clock::time_point{} && Clock::now() < frame.touched + kReading;
}

bool FrameDirectory::wants_pictures() const {
  for (std::uint32_t camera = 0; camera < opened_.size(); ++camera) {
    for (const std::uint32_t number : {std::uint32_t{0}, opened_[camera], opened_[camera] + 1}) {
      const auto found = frames_.find(number);
      if (found == frames_.end() || !found->second.there[camera]) return true;
      if (!being_read(found->second) && Clock::now() >= found->second.written + kOldest) return true;
    }
  }
  return false;
}

void FrameDirectory::put(std::vector<std::string> pictures) {
  KILOTWIN_DEMAND(pictures.size() == opened_.size());
  const auto newest = std::make_shared<const std::vector<std::string>>(std::move(pictures));
  std::set<std::uint32_t> numbers;
  for (const std::uint32_t opened : opened_) numbers.insert({0, opened, opened + 1});
  for (const std::uint32_t number : numbers) {
    Frame& frame = frames_[number];
    frame.there.resize(opened_.size());
    // A reader that joins in a frame that is being read gets the picture that belongs to it.
    const bool keeps = frame.content && being_read(frame);
    if (!keeps) {
      frame.content = newest;
      frame.written = Clock::now();
    }
    for (std::uint32_t camera = 0; camera < opened_.size(); ++camera) {
      if (!needed(camera, number) || (keeps && frame.there[camera])) continue;
      write(number, camera, (*frame.content)[camera]);
      frame.there[camera] = true;
    }
  }
}

fs::path FrameDirectory::path_of(std::uint32_t frame, std::uint32_t camera) const {
  return directory_ / fmt::format("frame_{:05}_{}.jpg", frame, camera);
}

void FrameDirectory::write(std::uint32_t frame, std::uint32_t camera, const std::string& picture) {
  os::write_file(path_of(frame, camera), picture);
}

}  // namespace kilotwin::cameras
