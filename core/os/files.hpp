/// Functions that read or write a whole file, files that are written in blocks, and the cache directory for compiled programs.
/// Every error is one line that names the file and the reason.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace kilotwin::os {

/// The whole content. Throws UserError if the file cannot be read.
[[nodiscard]] std::string read_file(const std::filesystem::path&);

/// The whole content of a regular file, or nothing if the file does not exist or cannot be read.
[[nodiscard]] std::optional<std::string> read_if_there(const std::filesystem::path&);

/// Replaces a file atomically: readers see the whole old content or the whole new one. Writes straight into a device or a pipe,
/// which cannot be replaced. Throws RunError.
void write_file(const std::filesystem::path&, std::string_view content);

/// The system's message for the current errno.
[[nodiscard]] std::string system_reason();

/// A file that is written in blocks. Child processes do not inherit its descriptor.
class OutputFile {
 public:
  enum class Existing { kRefuse, kReplace, kAppend };

  /// Throws RunError if the file cannot be created, or if it exists and `existing` is kRefuse.
  OutputFile(std::filesystem::path file, Existing existing);
  /// Writes the rest of the buffer and ignores errors. Call close() to learn of them.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// The bytes that the kernel does not have yet. Append to it.
  [[nodiscard]] std::string& buffer() { return buffer_; }
  /// Hands the buffer to the kernel, so that its bytes survive a crash of this process. On failure throws RunError and keeps the
  /// bytes that were not written, so that a later call continues with them.
  void flush();
  void flush_if_above(std::size_t bytes) {
    if (buffer_.size() >= bytes) flush();
  }
  /// flush(), and closes the file.
  void close();
  [[nodiscard]] const std::filesystem::path& path() const { return file_; }

 private:
  std::filesystem::path file_;
  int descriptor_ = -1;
  std::string buffer_;
};

/// A directory that this user may write to: `wanted` if given, else $XDG_CACHE_HOME/kilotwin or ~/.cache/kilotwin. If none of
/// them can be written to, it is a private directory in the system's temporary directory. Throws RunError if that fails too.
[[nodiscard]] std::filesystem::path cache_directory(const std::filesystem::path& wanted);

}  // namespace kilotwin::os
