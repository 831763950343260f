#include "core/os/temporary_folder.hpp"

#include <fmt/format.h>
#include <stdlib.h>

#include <string>

#include "core/base/error.hpp"
#include "core/os/files.hpp"

namespace kilotwin::os {
namespace fs = std::filesystem;

TemporaryFolder::TemporaryFolder(std::string_view name, const fs::path& within) {
  std::error_code error;
  const fs::path parent = within.empty() ? fs::temp_directory_path(error) : within;
  fs::create_directories(parent, error);
  std::string made = (parent / fmt::format("{}-XXXXXX", name)).string();
  if (mkdtemp(made.data()) == nullptr) {
    throw RunError(fmt::format("{}: cannot be made: {}{}", made, system_reason(),
                               within.empty() ? "; set TMPDIR to a folder with room" : ""));
  }
  path_ = made;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

}  // namespace kilotwin::os
