#include <fmt/format.h>

#include "clients/recorder/export.hpp"
#include "clients/recorder/observables.hpp"
#include "core/base/error.hpp"

namespace kilotwin::recorder {

std::uint64_t export_observables(Reader& recording, const std::filesystem::path& file,
                                 const TableMetadata& metadata) {
  const ObservableCurves curves = observe(recording);
  std::vector<Column> columns{{"time_s", "s", CellType::kNumber}};
  std::vector<const std::vector<double>*> values;
  for (const OwnCurve& own : curves.own) {
    columns.push_back({own.name, "", CellType::kNumber});
    values.push_back(&own.value);
  }
  for (std::size_t o = 0; o < kObservables.size(); ++o) {
    const ObservableInfo& info = kObservables[o];
    columns.push_back(
        {fmt::format("{}{}", info.name, info.column_suffix), std::string(info.unit), CellType::kNumber});
    values.push_back(&curves.value[o]);
  }
  const auto table = open_table(file, std::move(columns), metadata);
  for (std::size_t i = 0; i < curves.time_s.size(); ++i) {
    table->number(curves.time_s[i]);
    for (const std::vector<double>* column : values) table->number((*column)[i]);
    table->end_row();
  }
  table->close();
  return table->rows();
}

}  // namespace kilotwin::recorder
