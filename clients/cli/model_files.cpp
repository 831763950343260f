#include "clients/cli/model_files.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/base/error.hpp"

namespace kilotwin::cli {

namespace fs = std::filesystem;

std::vector<fs::path> model_files(const std::string& option, const std::vector<fs::path>& named) {
  std::vector<fs::path> files;
  for (const fs::path& name : named) {
    if (!fs::is_directory(name)) {
      files.push_back(name);
      continue;
    }
    std::vector<fs::path> within;
    for (const fs::directory_entry& entry : fs::directory_iterator(name)) {
      if (entry.path().extension() == ".txtpb") within.push_back(entry.path());
    }
    if (within.empty())
      throw UserError(
          fmt::format("{}: {} holds no model file (*.txtpb); kilotwin identify --draws N writes some into "
                      "OUT/draws",
                      option, name.string()));
    std::sort(within.begin(), within.end());
    files.insert(files.end(), within.begin(), within.end());
  }
  return files;
}

}  // namespace kilotwin::cli
