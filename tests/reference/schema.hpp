/// The schema of experiments, models and results of identification as Markdown: messages and fields of idl/*.proto with their comments, and units,
/// defaults and ranges of core/experiment/fields.hpp.
#pragma once

#include <filesystem>
#include <string>

namespace kilotwin::reference {

/// Every message that idl/experiment.proto and idl/door.proto define. `descriptors`: the .proto files as protoc --include_source_info wrote them.
/// Throws std::runtime_error where the file cannot be read.
[[nodiscard]] std::string experiment_schema(const std::filesystem::path& descriptors);
/// The same of idl/model.proto and idl/effects.proto.
[[nodiscard]] std::string model_schema(const std::filesystem::path& descriptors);

/// The keys of result.json: `Result` of idl/identification.proto and every message that it leads to.
[[nodiscard]] std::string result_keys(const std::filesystem::path& descriptors);

}  // namespace kilotwin::reference
