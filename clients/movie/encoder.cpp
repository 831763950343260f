#include "clients/movie/encoder.hpp"

#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <vector>

#include "core/base/error.hpp"
#include "core/os/files.hpp"

namespace kilotwin::movie {
namespace {

/// Quality by constant rate factors: differences to the drawing are hard to see, and text stays sharp.
std::vector<std::string> codec(Format format) {
  switch (format) {
    case Format::kMp4:
      return {"-c:v", "libx264", "-preset", "fast", "-crf", "20", "-pix_fmt", "yuv420p", "-movflags", "+faststart"};
    case Format::kWebm:
      return {"-c:v", "libvpx-vp9", "-crf", "32",        "-b:v", "0",        "-row-mt",
              "1",    "-deadline",  "good", "-cpu-used", "5",    "-pix_fmt", "yuv420p"};
    case Format::kGif:
      // One palette for the whole movie, made of what moves.
      return {"-filter_complex",
              "split[a][b];[a]palettegen=stats_mode=diff[p];[b][p]paletteuse=dither=none:diff_mode=rectangle"};
  }
  KILOTWIN_DEMAND(false);
  return {};
}

}  // namespace

std::optional<Format> format_of(const std::filesystem::path& file) {
  const std::string ending = file.extension().string();
  if (ending == ".mp4") return Format::kMp4;
  if (ending == ".webm") return Format::kWebm;
  if (ending == ".gif") return Format::kGif;
  return std::nullopt;
}

Encoder::Encoder(const std::filesystem::path& file, Format format, int width_px, int height_px, double frames_per_s)
    : file_(file) {
  const std::filesystem::path program = os::find_executable("ffmpeg");
  if (program.empty()) throw UserError("movie: needs the program ffmpeg; install it: apt-get install ffmpeg");
  os::Command command;
  command.program = program;
  command.arguments = {"ffmpeg", "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "bgr0", "-s",
                       fmt::format("{}x{}", width_px, height_px), "-r", fmt::format("{:g}", frames_per_s), "-i",
                       "pipe:0",
                       // No version and no date, so that equal frames make equal files.
                       "-fflags", "+bitexact", "-flags:v", "+bitexact", "-map_metadata", "-1"};
  for (std::string& word : codec(format)) command.arguments.push_back(std::move(word));
  command.arguments.push_back(std::filesystem::absolute(file).string());
  // A socket, unlike a pipe, can be written without a signal when its reader has ended.
  std::array<int, 2> ends{};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0)
    throw RunError("movie: ffmpeg cannot be connected: " + os::system_reason());
  pictures_.reset(ends[0]);
  const os::Descriptor theirs(ends[1]);
  words_.reset(memfd_create("ffmpeg", MFD_CLOEXEC));
  command.input = theirs.get();
  command.output = os::Command::kDiscard;
  command.errors = words_.get();
  command.at_death = SIGKILL;
  ffmpeg_.emplace(command);
}

void Encoder::add(std::span<const std::uint8_t> picture) {
  while (!picture.empty()) {
    const ssize_t sent = send(pictures_.get(), picture.data(), picture.size(), MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent < 0) fail();
    picture = picture.subspan(static_cast<std::size_t>(sent));
  }
}

void Encoder::finish() {
  pictures_.reset();
  if (!ffmpeg_->wait().well()) fail();
}

void Encoder::fail() {
  pictures_.reset();
  ffmpeg_->wait();
  std::array<char, 512> words{};
  const ssize_t size = pread(words_.get(), words.data(), words.size(), 0);
  std::string reason(words.data(), size > 0 ? static_cast<std::size_t>(size) : 0);
  reason = reason.substr(0, reason.find('\n'));
  throw RunError(
      fmt::format("{}: cannot be written: ffmpeg says: {}", file_.string(), reason.empty() ? "nothing" : reason));
}

}  // namespace kilotwin::movie
