/// The generated parts of docs/reference: tables of the schema with its ranges, the topics, the limits, the help of every
/// command. A page is written by hand, but for its regions:
///
///     <!-- generated: NAME -->
///     ...
///     <!-- end of NAME -->
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>

namespace kilotwin::reference {

/// Text of a region by its name.
using Regions = std::map<std::string, std::function<std::string()>>;

/// Regions `experiment`, `model`, `result-keys`, `topics`, `limits`, `counters` and `commands`. `sources`: the repository; `program`:
/// kilotwin.
[[nodiscard]] Regions regions(const std::filesystem::path& sources, const std::filesystem::path& program);

/// The page with each of its regions made anew. Throws std::runtime_error where a region is unknown or has no end.
[[nodiscard]] std::string regenerated(const std::string& page, const Regions& regions);

/// Pages with generated regions, of docs/reference.
inline constexpr const char* kPages[] = {"experiment.md", "model.md",       "result-keys.md", "topics.md",
                                         "limits.md",     "observables.md", "commands.md"};

/// The text of a file. Throws std::runtime_error where it cannot be read.
[[nodiscard]] std::string read_text(const std::filesystem::path&);

}  // namespace kilotwin::reference
