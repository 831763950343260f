#include "clients/recorder/swarm_observables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "clients/recorder/export.hpp"
#include "core/base/error.hpp"
#include "core/base/ids.hpp"

namespace kilotwin::recorder {
namespace {

/// A colour is which channels are lit: red | green << 1 | blue << 2.
constexpr std::array<std::string_view, 8> kColours{"off",  "red",     "green", "yellow",
                                                   "blue", "magenta", "cyan",  "white"};
constexpr std::array<LifeCycle, 10> kLifeCycles{
    LifeCycle::kSleeping, LifeCycle::kIdle,   LifeCycle::kBattery, LifeCycle::kSetup, LifeCycle::kRunning,
    LifeCycle::kCharging, LifeCycle::kMoving, LifeCycle::kAbsent,  LifeCycle::kFlat,  LifeCycle::kFailed};
constexpr std::array<std::string_view, 12> kPerRobot{"x_mm",  "y_mm",   "heading_rad", "displacement_mm",
                                                     "led",   "led_r",  "led_g",       "led_b",
                                                     "state", "failed", "group",       "robot"};

double colour_of(std::uint8_t led) {
  return ((led & 3) != 0 ? 1 : 0) | ((led >> 2 & 3) != 0 ? 2 : 0) | ((led >> 4 & 3) != 0 ? 4 : 0);
}

/// The value of a colour's or life cycle's name; NaN for others.
double constant_of(const std::string& name) {
  for (std::size_t colour = 0; colour < kColours.size(); ++colour) {
    if (kColours[colour] == name) return static_cast<double>(colour);
  }
  for (const LifeCycle state : kLifeCycles) {
    if (state_name(static_cast<std::uint8_t>(state)) == name) return static_cast<double>(state);
  }
  return std::numeric_limits<double>::quiet_NaN();
}

const ObservableInfo* built_in(const std::string& name) {
  const auto* const found = std::find_if(kObservables.begin(), kObservables.end(),
                                         [&](const ObservableInfo& o) { return o.name == name; });
  return found == kObservables.end() ? nullptr : found;
}

}  // namespace

NameKind kind_of_name(const std::string& name, const std::vector<std::string>& variables) {
  if (std::find(variables.begin(), variables.end(), name) != variables.end()) return NameKind::kPerRobot;
  if (std::find(kPerRobot.begin(), kPerRobot.end(), name) != kPerRobot.end()) return NameKind::kPerRobot;
  if (name == "time_s" || built_in(name) != nullptr || !std::isnan(constant_of(name))) return NameKind::kSingle;
  return NameKind::kUnknown;
}

SwarmObservables::SwarmObservables(const proto::RecordingHeader& header, std::optional<std::uint32_t> only)
    : groups_(groups_of(header)), only_(only) {
  for (const proto::VariableColumn& variable : header.variable()) variables_.push_back(variable.name());
  for (const proto::Observable& observable : header.observable()) {
    try {
      expressions_.push_back(Expression::parse(
          observable.value(), [this](const std::string& name) { return kind_of_name(name, variables_); }));
    } catch (const UserError& error) {
      throw UserError(fmt::format("observable {}: {}", observable.name(), error.what()));
    }
    names_.push_back(observable.name());
    for (const std::string& name : expressions_.back().names()) columns_.try_emplace(name);
  }
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  for (auto& [name, column] : columns_) {
    column.assign(kind_of_name(name, variables_) == NameKind::kPerRobot ? header.robots() : 1, kNone);
    if (column.size() == 1) column[0] = constant_of(name);
  }
}

void SwarmObservables::take(const proto::VariableRecord& variable) {
  const auto column = columns_.find(variables_[variable.variable()]);
  if (column == columns_.end()) return;
  for (int i = 0; i < variable.robot_size(); ++i) {
    if (!counts(variable.robot(i))) continue;
    column->second[variable.robot(i)] =
        variable.integer_size() != 0 ? static_cast<double>(variable.integer(i)) : variable.number(i);
  }
}

void SwarmObservables::fill(double time_s, const proto::StateRecord& state, const ObservableCurves& curves) {
  const auto each = [&](const char* name, auto value) {
    const bool is_variable = std::find(variables_.begin(), variables_.end(), name) != variables_.end();
    if (!uses(name) || is_variable) return;
    std::vector<double>& column = columns_.at(name);
    const bool per_robot = kind_of_name(name, variables_) == NameKind::kPerRobot;
    for (std::size_t i = 0; i < column.size(); ++i) {
      if (!per_robot || counts(i)) column[i] = static_cast<double>(value(static_cast<int>(i)));
    }
  };
  const auto led = [&](int i) { return static_cast<std::uint8_t>(state.led()[static_cast<std::size_t>(i)]); };
  const auto life_cycle = [&](int i) {
    return static_cast<std::uint8_t>(state.life_cycle()[static_cast<std::size_t>(i)]);
  };
  each("x_mm", [&](int i) { return state.x_mm(i); });
  each("y_mm", [&](int i) { return state.y_mm(i); });
  each("heading_rad", [&](int i) { return state.heading_rad(i); });
  each("displacement_mm", [&](int i) {
    const auto at = static_cast<std::size_t>(i);
    return std::hypot(state.x_mm(i) - start_x_mm_[at], state.y_mm(i) - start_y_mm_[at]);
  });
  each("led", [&](int i) { return colour_of(led(i)); });
  each("led_r", [&](int i) { return led(i) & 3; });
  each("led_g", [&](int i) { return led(i) >> 2 & 3; });
  each("led_b", [&](int i) { return led(i) >> 4 & 3; });
  each("state", life_cycle);
  each("failed", [&](int i) { return life_cycle(i) == static_cast<std::uint8_t>(LifeCycle::kFailed) ? 1 : 0; });
  each("group", [&](int i) { return groups_[static_cast<std::size_t>(i)]; });
  each("robot", [&](int i) { return i; });
  each("time_s", [&](int) { return time_s; });
  for (std::size_t o = 0; o < kObservables.size(); ++o) {
    if (!curves.value[o].empty()) each(kObservables[o].name.data(), [&](int) { return curves.value[o].back(); });
  }
}

std::vector<double> SwarmObservables::values(double time_s, const proto::StateRecord& state,
                                             const ObservableCurves& curves) {
  if (start_x_mm_.empty()) {
    start_x_mm_.assign(state.x_mm().begin(), state.x_mm().end());
    start_y_mm_.assign(state.y_mm().begin(), state.y_mm().end());
  }
  fill(time_s, state, curves);
  const NamedValues named = [this](const std::string& name) -> const std::vector<double>& {
    return columns_.at(name);
  };
  std::vector<double> values;
  for (const Expression& expression : expressions_)
    values.push_back(expression.value(static_cast<std::size_t>(state.x_mm_size()), named));
  return values;
}

}  // namespace kilotwin::recorder
