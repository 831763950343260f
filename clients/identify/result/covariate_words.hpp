/// The covariates of effects in words: one vocabulary for the result, the page and its plots.
#pragma once

#include <string>
#include <string_view>

namespace kilotwin::identify {

/// A covariate of result.json as the object of "depends on ...". Other names have their underscores as blanks.
[[nodiscard]] std::string covariate_in_words(std::string_view covariate);

}  // namespace kilotwin::identify
