/// Summary of the report: headline, a few sentences, and error bars.
#pragma once

#include "clients/identify/report/report_text.hpp"

namespace kilotwin::identify::report {

/// Root mean square errors, mm.
struct Errors {
  std::optional<double> before, after, floor;
};
[[nodiscard]] Errors errors_of(const identification::Result&);

/// The header of identification.mustache.
void add_summary(Data& page, const identification::Identification&);

}  // namespace kilotwin::identify::report
