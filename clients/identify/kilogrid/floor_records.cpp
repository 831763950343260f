#include "clients/identify/kilogrid/floor_records.hpp"

#include <algorithm>
#include <span>
#include <string>
#include <vector>

namespace kilotwin::kilogrid {
namespace {

using proto::Effect, proto::Function;

/// Gains beside one wall, `values` along it, ascending.
void add_wall(FloorSettings& settings, const Side& side, std::span<const double> values) {
  Effect& effect = add_effect(settings, (std::string("wall-") + side.name).c_str(), Effect::WHEEL_GAIN);
  add_beside(effect, side, 1);
  proto::Steps& along =
      *add_function(effect, side.across == Function::X ? Function::Y : Function::X).mutable_steps();
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (i > 0)
      along.add_at(side.half_along_mm * (2 * static_cast<double>(i) / static_cast<double>(values.size()) - 1));
    along.add_value(values[i]);
  }
}

}  // namespace

Effect& add_effect(FloorSettings& settings, const char* name, Effect::Target target) {
  Effect& effect = *settings.model.add_effect();
  effect.set_name(name);
  effect.set_acts_on(target);
  return effect;
}

Function& add_function(Effect& effect, Function::Covariate of) {
  Function& function = *effect.add_function();
  if (of != Function::NOTHING) function.set_of(of);
  return function;
}

std::array<Side, 4> sides_of(const Floor& floor) {
  const double x_mm = floor.width_mm / 2, y_mm = floor.height_mm / 2, beside_mm = FloorModel::kBeside_mm;
  return {Side{"bottom", Function::Y, false, beside_mm - y_mm, x_mm},
          {"right", Function::X, true, x_mm - beside_mm, y_mm},
          {"top", Function::Y, true, y_mm - beside_mm, x_mm},
          {"left", Function::X, false, beside_mm - x_mm, y_mm}};
}

void add_beside(Effect& effect, const Side& side, double value) {
  proto::Steps& beside = *add_function(effect, side.across).mutable_steps();
  beside.add_at(side.at_mm);
  beside.add_value(side.above ? 0 : value);
  beside.add_value(side.above ? value : 0);
}

void add_walls(FloorSettings& settings, const Floor& floor, const std::array<double, kBoundarySections>& wall) {
  std::array<double, kBoundarySections> gain;
  for (std::size_t i = 0; i < kBoundarySections; ++i) gain[i] = wall[i] - 1;
  const std::span<const double> all(gain);
  std::vector<double> top(all.begin() + 12, all.begin() + 16), left(all.begin() + 16, all.end());
  std::reverse(top.begin(), top.end());
  std::reverse(left.begin(), left.end());
  const std::array<Side, 4> sides = sides_of(floor);
  add_wall(settings, sides[0], all.first(4));
  add_wall(settings, sides[1], all.subspan(4, 8));
  add_wall(settings, sides[2], top);
  add_wall(settings, sides[3], left);
}

}  // namespace kilotwin::kilogrid
