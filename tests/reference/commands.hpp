/// The help of every command of kilotwin as Markdown.
#pragma once

#include <filesystem>
#include <string>

namespace kilotwin::reference {

/// The output of `kilotwin --help` and `kilotwin COMMAND --help`, a section per command. Throws std::runtime_error where the
/// program does not run.
[[nodiscard]] std::string commands_help(const std::filesystem::path& program);

}  // namespace kilotwin::reference
