/// `kilotwin track --calibrate`: from the pictures of a source to a calibration file.
#pragma once

#include <filesystem>
#include <string>

#include "clients/track/calibrate.hpp"

namespace kilotwin::cli {

/// "9x6", "2000x1500.5": two numbers above 0. Throws UserError that names the option.
[[nodiscard]] cv::Size2d two_numbers(const std::string& option, const std::string& text);

/// Takes pictures of the source (at most 40, spread over it), writes `file` and says how good it is.
void calibrate_from(const std::string& source, const track::Board& board, double disc_height_mm,
                    const std::filesystem::path& file);

}  // namespace kilotwin::cli
