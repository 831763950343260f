#include "clients/view/page_files.hpp"

#include <fmt/format.h>

#include <array>
#include <string_view>
#include <utility>

#include "core/base/error.hpp"
#include "core/os/files.hpp"

namespace kilotwin::view {
namespace fs = std::filesystem;
namespace {

constexpr std::string_view kNotBuilt =
    "<!doctype html><html lang=\"en\"><title>Kilotwin</title><h1>The page was not built</h1>"
    "<p>Building it needs Node.js and the npm packages of scripts/npm-packages.txt. In the sources of Kilotwin run "
    "<code>scripts/setup &amp;&amp; cmake --preset release &amp;&amp; cmake --build --preset release</code>, then "
    "start "
    "<code>kilotwin view</code> again.</p></html>";

constexpr std::array<std::pair<std::string_view, const char*>, 5> kTypes{{{".html", "text/html; charset=utf-8"},
                                                                          {".js", "text/javascript; charset=utf-8"},
                                                                          {".css", "text/css; charset=utf-8"},
                                                                          {".svg", "image/svg+xml"},
                                                                          {".json", "application/json"}}};

const char* type_of(const fs::path& file) {
  for (const auto& [ending, type] : kTypes) {
    if (file.extension() == ending) return type;
  }
  return "application/octet-stream";
}

}  // namespace

PageFiles::PageFiles(const fs::path& directory) {
  std::error_code none;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(directory, none)) {
    if (!entry.is_regular_file()) continue;
    const std::string path = "/" + entry.path().lexically_relative(directory).generic_string();
    files_.emplace(path, PageFile{os::read_file(entry.path()), type_of(entry.path())});
  }
  const auto index = files_.find("/index.html");
  if (index == files_.end())
    throw UserError(
        fmt::format("{}: has no index.html; expected the directory of a built page", directory.string()));
  files_.emplace("/", index->second);
  built_ = true;
}

PageFiles PageFiles::of_this_program() {
  const fs::path beside = fs::read_symlink("/proc/self/exe").parent_path();
  for (const fs::path& directory : {beside / "page", beside.parent_path() / "share/kilotwin/page",
                                    beside.parent_path().parent_path() / "share/kilotwin/page"}) {
    if (fs::exists(directory / "index.html")) return PageFiles(directory);
  }
  PageFiles page;
  page.files_.emplace("/", PageFile{std::string(kNotBuilt), "text/html; charset=utf-8"});
  return page;
}

const PageFile* PageFiles::find(const std::string& path) const {
  const auto found = files_.find(path);
  return found == files_.end() ? nullptr : &found->second;
}

}  // namespace kilotwin::view
