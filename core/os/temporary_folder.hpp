/// TemporaryFolder: a folder of this process, which goes with all that is in it.
#pragma once

#include <filesystem>
#include <string_view>

namespace kilotwin::os {

class TemporaryFolder {
 public:
  /// Makes a new folder NAME-XXXXXX, with letters of its own in place of the Xs, in `within`, which is made where it is missing.
  /// Empty: in the system's folder for temporary files (TMPDIR). Throws RunError.
  explicit TemporaryFolder(std::string_view name, const std::filesystem::path& within = {});
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace kilotwin::os
