/// Files as the recorder writes and reads them. Whatever fails is told in one line that names the file and the
/// reason.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

namespace kilotwin::recorder {

/// A file that is written from its beginning, in blocks. Not inherited by child processes.
class OutputFile {
 public:
  enum class Existing { kRefuse, kReplace };

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

/// Writes a file as a whole: readers see the old one or the new one, nothing in between. Throws RunError.
void write_file(const std::filesystem::path& file, std::string_view content);

/// The whole content. Throws UserError where it cannot be read.
[[nodiscard]] std::string read_file(const std::filesystem::path& file);

/// The system's words for the errno at hand.
[[nodiscard]] std::string system_reason();

}  // namespace kilotwin::recorder
