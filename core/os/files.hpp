/// Whole files in and out, files that are written in blocks, and the directory where compiled programs are kept. Every failure is
/// one line that names the file and the reason.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace kilotwin::os {

/// The whole content. Throws UserError where it cannot be read.
[[nodiscard]] std::string read_file(const std::filesystem::path&);

/// The whole content of a regular file; nothing where there is none or it cannot be read.
[[nodiscard]] std::optional<std::string> read_if_there(const std::filesystem::path&);

/// Writes a file as a whole: readers see the old one or the new one, nothing in between. A device or a pipe, which cannot be
/// replaced, is written to. Throws RunError.
void write_file(const std::filesystem::path&, std::string_view content);

/// The system's words for the errno at hand.
[[nodiscard]] std::string system_reason();

/// A file that is written from its beginning, in blocks. Not inherited by child processes.
class OutputFile {
 public:
  enum class Existing { kRefuse, kReplace, kAppend };

  /// Throws RunError where the file cannot be created, or exists and must not.
  OutputFile(std::filesystem::path file, Existing existing);
  /// Hands over what is left as far as that is possible; whoever wants to know of errors calls close().
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// The bytes that wait to be handed to the kernel; to be appended to.
  [[nodiscard]] std::string& buffer() { return buffer_; }
  /// Hands all of them over, after which they outlive this process. On failure throws RunError, and keeps what was
  /// not written, so that a later call goes on where this one stopped.
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

/// A directory that this user may write to: `wanted` if given, else $XDG_CACHE_HOME/kilotwin or ~/.cache/kilotwin; where
/// none of them can be had, a private directory of this user among the system's temporary files. Throws RunError where that fails too.
[[nodiscard]] std::filesystem::path cache_directory(const std::filesystem::path& wanted);

}  // namespace kilotwin::os
