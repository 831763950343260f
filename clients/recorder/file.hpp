/// Files as the recorder writes and reads them. Errors are one line that names the file and the reason.
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
  /// Writes the rest of the buffer if that is possible. Only close() reports errors.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// The bytes that flush() will write. Callers append to it.
  [[nodiscard]] std::string& buffer() { return buffer_; }
  /// Writes the buffer; the bytes then outlive this process. On failure throws RunError and keeps the bytes that were not
  /// written, so that a later call continues.
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

/// Writes the file whole: readers see the old content or the new content, never a part. Throws RunError.
void write_file(const std::filesystem::path& file, std::string_view content);

/// The whole content. Throws UserError where it cannot be read.
[[nodiscard]] std::string read_file(const std::filesystem::path& file);

/// The system's description of the current errno.
[[nodiscard]] std::string system_reason();

}  // namespace kilotwin::recorder
