#pragma once

#include <filesystem>
#include <system_error>
#include <utility>

namespace kilotwin::cli {

/// Removes the directory unless it is kept: a command that fails leaves no files.
class Unfinished {
 public:
  explicit Unfinished(std::filesystem::path directory) : directory_(std::move(directory)) {}
  ~Unfinished() {
    std::error_code ignored;
    if (!kept_) std::filesystem::remove_all(directory_, ignored);
  }
  Unfinished(const Unfinished&) = delete;
  void keep() { kept_ = true; }

 private:
  std::filesystem::path directory_;
  bool kept_ = false;
};

}  // namespace kilotwin::cli
