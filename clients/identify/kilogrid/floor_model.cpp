#include "clients/identify/kilogrid/floor_model.hpp"

#include "clients/identify/kilogrid/floor_records.hpp"

namespace kilotwin::kilogrid {

void FloorModel::add(const FloorTerm& term) {
  terms.push_back(term);
  for (const FloorParameter& parameter : term.parameters) values.push_back(parameter.start);
}

std::size_t FloorModel::first_of(std::size_t term) const {
  std::size_t first = 0;
  for (std::size_t t = 0; t < term; ++t) first += terms[t].parameters.size();
  return first;
}

std::vector<FloorParameter> FloorModel::parameters() const {
  std::vector<FloorParameter> all;
  for (const FloorTerm& term : terms) all.insert(all.end(), term.parameters.begin(), term.parameters.end());
  return all;
}

FloorSettings FloorModel::settings(std::span<const double> values_of_all) const {
  FloorSettings settings;
  settings.radio.later = later;
  std::size_t first = 0;
  for (const FloorTerm& term : terms) {
    term.apply(values_of_all.subspan(first, term.parameters.size()), settings);
    first += term.parameters.size();
  }
  if (wall) add_walls(settings, Floor{}, *wall);
  return settings;
}

FloorModel FloorModel::without(std::size_t term) const {
  FloorModel less;
  less.wall = wall;
  less.later = later;
  for (std::size_t t = 0; t < terms.size(); ++t) {
    if (t == term) continue;
    less.terms.push_back(terms[t]);
    const std::size_t first = first_of(t);
    less.values.insert(less.values.end(), values.begin() + static_cast<std::ptrdiff_t>(first),
                       values.begin() + static_cast<std::ptrdiff_t>(first + terms[t].parameters.size()));
  }
  return less;
}

}  // namespace kilotwin::kilogrid
