/// Several models of the same robots, such as draws from the posterior of an identification.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace kilotwin::cli {

/// The model files that an option names: files, and of directories all *.txtpb by name. Throws UserError, which names `option`, where
/// there is none.
[[nodiscard]] std::vector<std::filesystem::path> model_files(const std::string& option,
                                                             const std::vector<std::filesystem::path>& named);

}  // namespace kilotwin::cli
