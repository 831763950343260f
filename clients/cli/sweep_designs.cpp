#include "clients/cli/sweep_designs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "clients/cli/text_table.hpp"
#include "core/csv/csv_writer.hpp"

namespace kilotwin::cli {
namespace {

namespace fs = std::filesystem;
using stats::Moments;

Moments mean_over(const std::map<std::uint64_t, double>& by_seed) {
  Moments sample;
  for (const auto& [seed, value] : by_seed) sample.add(value);
  return sample;
}

std::string number_pair(const Moments& sample) {
  return sample.count() == 0 ? std::string(",")
                             : fmt::format("{:.10g},{:.4g}", sample.mean(), sample.standard_error());
}

}  // namespace

bool is_model(const std::string& set) { return field_of(set) == kModelField; }

std::vector<SweepPoint> with_models(const std::vector<SweepPoint>& points, const std::vector<fs::path>& models) {
  std::vector<SweepPoint> all;
  for (const SweepPoint& point : points) {
    for (const fs::path& model : models) {
      all.push_back(point);
      all.back().push_back(std::string(kModelField) + "=" + model.string());
    }
  }
  return all;
}

SweepDesigns::SweepDesigns(const std::vector<SweepPoint>& points, bool largest) : largest_(largest) {
  std::map<SweepPoint, std::size_t> index_of;
  for (const SweepPoint& point : points) {
    SweepPoint fields;
    std::string model;
    for (const std::string& set : point) {
      if (is_model(set))
        model = set.substr(set.find('=') + 1);
      else
        fields.push_back(set);
    }
    const auto [found, is_new] = index_of.try_emplace(fields, designs_.size());
    if (is_new) designs_.push_back({fields, {}});
    designs_[found->second].by_model[model];
    place_.emplace_back(found->second, model);
  }
}

void SweepDesigns::add(std::size_t point, std::uint64_t seed, double value) {
  const auto& [design, model] = place_.at(point);
  if (std::isfinite(value)) designs_[design].by_model[model][seed] = value;
}

Design SweepDesigns::design_of(const OfDesign& values) const {
  Design design;
  design.fields = values.fields;
  bool complete = true;
  for (const auto& [model, by_seed] : values.by_model) {
    complete = complete && !by_seed.empty();
    if (by_seed.empty()) continue;
    const double mean = mean_over(by_seed).mean();
    const bool worse = largest_ ? mean < design.worst : mean > design.worst;
    if (design.over_models.count() == 0 || worse) {
      design.worst = mean;
      design.worst_model = model;
    }
    design.over_models.add(mean);
  }
  design.rank = complete ? 1 : 0;
  return design;
}

std::vector<Design> SweepDesigns::ranked() const {
  std::vector<std::pair<Design, const OfDesign*>> all;
  for (const OfDesign& values : designs_) all.emplace_back(design_of(values), &values);
  std::stable_sort(all.begin(), all.end(), [this](const auto& a, const auto& b) {
    if (a.first.rank != b.first.rank) return a.first.rank > b.first.rank;
    return largest_ ? a.first.worst > b.first.worst : a.first.worst < b.first.worst;
  });
  std::vector<Design> ranked;
  for (auto& [design, values] : all) {
    if (design.rank > 0) design.rank = ranked.size() + 1;
    for (const auto& [model, by_seed] : values->by_model) {
      const BySeed& best = all.front().second->by_model.at(model);
      Moments differences;
      for (const auto& [seed, value] : by_seed) {
        if (const auto other = best.find(seed); other != best.end()) differences.add(value - other->second);
      }
      if (differences.count() > 0) design.to_best.add(differences.mean());
    }
    ranked.push_back(std::move(design));
  }
  return ranked;
}

std::string designs_csv(const std::vector<Design>& designs, const std::string& observable) {
  std::string csv = "rank";
  for (const std::string& set : designs.front().fields) csv += "," + csv_cell(field_of(set));
  csv += fmt::format(",models,{0},{0}_se,worst,worst_model,to_best,to_best_se\n", csv_cell(observable));
  for (const Design& design : designs) {
    csv += design.rank > 0 ? std::to_string(design.rank) : std::string();
    for (const std::string& set : design.fields) csv += "," + csv_cell(set.substr(set.find('=') + 1));
    csv += fmt::format(",{},{},", design.over_models.count(), number_pair(design.over_models));
    if (design.over_models.count() > 0) csv += fmt::format("{:.10g}", design.worst);
    csv += fmt::format(",{},{}\n", csv_cell(design.worst_model), number_pair(design.to_best));
  }
  return csv;
}

std::vector<std::vector<std::string>> design_rows(const std::vector<Design>& designs,
                                                  const std::string& observable) {
  std::vector<std::vector<std::string>> rows{
      {"over the models", "rank", "mean " + observable, "worst", "difference from rank 1"}};
  for (const Design& design : designs) {
    const bool any = design.over_models.count() > 0;
    rows.push_back({design.fields.empty() ? "the experiment" : label(design.fields),
                    design.rank > 0 ? std::to_string(design.rank) : "-", with_error(design.over_models),
                    any ? fmt::format("{:.5g}", design.worst) : "-", with_error(design.to_best)});
  }
  return rows;
}

}  // namespace kilotwin::cli
