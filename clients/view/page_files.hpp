/// PageFiles: the files of the page, read once at the start. The server knows no path of the file system.
#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace kilotwin::view {

struct PageFile {
  std::string content;
  const char* type;  ///< MIME type
};

class PageFiles {
 public:
  /// The page beside the running program: in a build directory `page/`, installed `share/kilotwin/page/` beside bin or libexec.
  /// Where it was not built, one that says how to build it.
  [[nodiscard]] static PageFiles of_this_program();
  /// All files in a directory. Throws UserError where it has no index.html.
  explicit PageFiles(const std::filesystem::path& directory);

  /// By path in the URL, such as "/" or "/assets/index.js"; nullptr: none.
  [[nodiscard]] const PageFile* find(const std::string& path) const;
  /// false: it was not built.
  [[nodiscard]] bool built() const { return built_; }

 private:
  PageFiles() = default;
  std::map<std::string, PageFile> files_;
  bool built_ = false;
};

}  // namespace kilotwin::view
