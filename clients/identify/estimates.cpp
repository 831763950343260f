#include "clients/identify/estimates.hpp"

#include <algorithm>
#include <cmath>

#include "core/stats/distributions.hpp"

namespace kilotwin::identify {
namespace {

using identification::Estimate;

constexpr const char* kByInformation = "standard deviation by the information of the fit";

Estimate with_sd(const std::string& name, const std::string& unit, double value, double sd) {
  Estimate out;
  out.set_name(name);
  out.set_unit(unit);
  out.set_value(value);
  out.set_low(value - stats::kNormal95 * sd);
  out.set_high(value + stats::kNormal95 * sd);
  out.set_how(kByInformation);
  return out;
}

/// Wavelength and speed of a wave, whose numbers are `wave` of the held ones, from the first on: x, y and, if it moves, the frequency.
void add_wave(std::vector<Estimate>& to, const Uncertainty& u, Eigen::Index wave, bool moves) {
  const Eigen::Index columns = u.all.rows() - u.held.size() + wave, n = moves ? 3 : 2;
  const auto number = [&](Eigen::Index i) { return u.held.numbers[static_cast<std::size_t>(wave + i)].value; };
  const double kx = number(0), ky = number(1), k = std::hypot(kx, ky);
  if (!(k > 0)) return;
  const Eigen::MatrixXd covariance = u.all.block(columns, columns, n, n);
  const auto add = [&](const char* name, const char* unit, double value, const Eigen::VectorXd& slope) {
    to.push_back(with_sd(name, unit, value, std::sqrt(std::max(0.0, slope.dot(covariance * slope)))));
  };
  Eigen::VectorXd by_k = Eigen::VectorXd::Zero(n);
  by_k[0] = kx / k;
  by_k[1] = ky / k;
  add("wavelength", "mm", 2 * M_PI / k, -2 * M_PI / (k * k) * by_k);
  if (!moves) return;
  const double speed = number(2) / k;
  Eigen::VectorXd slope = -speed / k * by_k;
  slope[2] = 1 / k;
  add("phase speed", "mm/s", speed, slope);
}

std::string step_name(const StepInterval& step) {
  // Sums over neighbours by their distance reach to a radius, where they are 0.
  if (step.is_radius) return step.axis.of == Covariate::kNeighbours ? "radius" : "reach";
  if (step.axis.of == Covariate::kTime) return "instant";
  std::string name = name_of(step.axis.of);
  std::replace(name.begin(), name.end(), '_', ' ');
  return "step at " + name;
}

Estimate estimate_of(const StepInterval& step) {
  Estimate out;
  out.set_name(step_name(step));
  out.set_unit(step.is_radius ? "mm" : unit_of(step.axis.of));
  out.set_value(step.at);
  if (step.low) out.set_low(*step.low);
  if (step.high) out.set_high(*step.high);
  out.set_how("profile likelihood");
  return out;
}

}  // namespace

std::vector<Estimate> estimates_of(std::size_t term, const Uncertainty& u, const std::vector<StepInterval>& steps) {
  std::vector<Estimate> out, amplitudes;
  const Eigen::Index first = u.all.rows() - u.held.size();
  using Kind = HeldNumber::Kind;
  for (Eigen::Index i = 0; i < u.held.size(); ++i) {
    const HeldNumber& number = u.held.numbers[static_cast<std::size_t>(i)];
    if (number.term != term || number.name.empty()) continue;
    Estimate one = with_sd(number.name, number.unit, number.value, u.sd(first + i));
    if (number.is_open(u.sd(first + i))) {
      one.clear_low();
      one.clear_high();
      one.set_how("no interval: these data leave it open");
    }
    (number.kind == Kind::kAmplitude ? amplitudes : out).push_back(std::move(one));
    const auto next = static_cast<std::size_t>(i) + 1;
    if (number.kind == Kind::kWaveNumberY)
      add_wave(out, u, i - 1, next < u.held.numbers.size() && u.held.numbers[next].kind == Kind::kAngularFrequency);
  }
  std::vector<StepInterval> own;
  for (const StepInterval& step : steps)
    if (step.term == term) own.push_back(step);
  std::stable_sort(own.begin(), own.end(),
                   [](const StepInterval& a, const StepInterval& b) { return a.at < b.at; });
  for (const StepInterval& step : own) out.push_back(estimate_of(step));
  out.insert(out.end(), amplitudes.begin(), amplitudes.end());
  return out;
}

}  // namespace kilotwin::identify
