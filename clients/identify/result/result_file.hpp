/// Reads a result.json that `kilotwin identify` wrote.
#pragma once

#include <filesystem>

#include "idl/identification.pb.h"

namespace kilotwin::identify {

/// Throws UserError if the file is missing or is no result. Keys of other versions are ignored; null stands for absent.
[[nodiscard]] identification::Result read_result(const std::filesystem::path& file);

}  // namespace kilotwin::identify
