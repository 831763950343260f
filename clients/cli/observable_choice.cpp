#include "clients/cli/observable_choice.hpp"

#include <fmt/format.h>

#include <cmath>

#include "clients/recorder/reader.hpp"
#include "core/base/error.hpp"

namespace kilotwin::cli {

std::optional<recorder::Observable> built_in_observable(const std::string& name) {
  for (std::size_t o = 0; o < recorder::kObservables.size(); ++o) {
    if (recorder::kObservables[o].name == name) return static_cast<recorder::Observable>(o);
  }
  return std::nullopt;
}

void check_observable(const std::string& option, const std::string& name, const proto::Experiment& experiment) {
  if (built_in_observable(name)) return;
  std::string names;
  for (const recorder::ObservableInfo& info : recorder::kObservables)
    names += (names.empty() ? "" : ", ") + std::string(info.name);
  for (const proto::Observable& own : experiment.observable()) {
    if (own.name() == name) return;
    names += ", " + own.name();
  }
  throw UserError(fmt::format("{}: no observable \"{}\"; there are {}", option, name, names));
}

double observable_at_end(const std::filesystem::path& run, const std::string& name) {
  recorder::Reader recording(run / "recording.ktrec");
  const recorder::ObservableCurves curves = recorder::observe(recording);
  const auto last = [](const std::vector<double>& values) { return values.empty() ? std::nan("") : values.back(); };
  for (const recorder::OwnCurve& own : curves.own) {
    if (own.name == name) return last(own.value);
  }
  const auto built_in = built_in_observable(name);
  return built_in ? last(curves.of(*built_in)) : std::nan("");
}

}  // namespace kilotwin::cli
