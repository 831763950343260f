/// Video files, by the program ffmpeg.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include "core/os/descriptor.hpp"
#include "core/os/process.hpp"

namespace kilotwin::movie {

enum class Format { kMp4, kWebm, kGif };
/// By the end of the name: .mp4 (H.264), .webm (VP9), .gif; nothing for others.
[[nodiscard]] std::optional<Format> format_of(const std::filesystem::path& file);

/// Encodes frames as they come. The same frames make the same file.
class Encoder {
 public:
  /// Starts ffmpeg, which replaces `file`. Width and height must be even. Throws UserError if ffmpeg is not installed.
  Encoder(const std::filesystem::path& file, Format format, int width_px, int height_px, double frames_per_s);

  /// One frame as rasterised() returns it. Throws RunError with ffmpeg's words if it has ended.
  void add(std::span<const std::uint8_t> picture);
  /// Waits until the file is complete. Throws RunError with ffmpeg's words if it is not.
  void finish();

 private:
  [[noreturn]] void fail();

  std::filesystem::path file_;
  os::Descriptor pictures_, words_;
  std::optional<os::Process> ffmpeg_;
};

}  // namespace kilotwin::movie
