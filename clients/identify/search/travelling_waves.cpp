#include "clients/identify/search/travelling_waves.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <utility>

#include "clients/identify/search/dictionary_builder.hpp"
#include "clients/identify/search/local_quadratic.hpp"
#include "clients/identify/search/visits.hpp"
#include "core/os/worker_pool.hpp"

namespace kilotwin::identify {
namespace {

/// Shortest wavelength and period, and the spacing of the raster as a share of the resolution of the data.
constexpr double kShortest_mm = 120, kShortest_s = 12, kSpacing = 0.5;
/// Peaks that become hypotheses.
constexpr std::size_t kPeaks = 4;
/// Visits that the periodogram uses, and its largest number of wave numbers x frequencies x visits.
constexpr std::size_t kMostVisits = 25000;
constexpr double kMostTerms = 3e9;
/// Steps of the ascent from one peak. It settles after some tens.
constexpr int kMostSteps = 300;

struct Point {
  double x_mm, y_mm, time_s, score, information;
};

/// Wave numbers, rad/mm, and angular frequency, rad/s.
using Wave = std::array<double, 3>;

std::vector<Point> points_of(const Fitter& fitter, const FitState& state) {
  const Visits visits = visits_of(fitter, state, kDriven);
  std::vector<Point> all;
  for (std::size_t r = 0; r < visits.runs.size(); ++r) {
    const double start_s = state.tracks.neighbours(r).instants() > 0 ? state.tracks.neighbours(r).time_s(0) : 0;
    for (std::size_t i = 0; i < visits.runs[r].size(); ++i)
      for (const Visit& v : visits.runs[r][i])
        if (v.information > 0)
          all.push_back(
              {v.x_mm, v.y_mm, start_s + static_cast<double>(i) * visits.every_s, v.score, v.information});
  }
  const std::size_t every = all.size() / kMostVisits + 1;
  std::vector<Point> some;
  for (std::size_t i = 0; i < all.size(); i += every) some.push_back(all[i]);
  return some;
}

/// Half the sum of squares that a wave of this phase explains.
double power_of(const std::vector<Point>& points, const Wave& k) {
  double cosine = 0, sine = 0, cc = 0, ss = 0;
  for (const Point& p : points) {
    const double phase = k[0] * p.x_mm + k[1] * p.y_mm - k[2] * p.time_s;
    const double c = std::cos(phase), s = std::sin(phase);
    cosine += p.score * c;
    sine += p.score * s;
    cc += p.information * c * c;
    ss += p.information * s * s;
  }
  return 0.5 * (cosine * cosine / std::max(cc, 1e-9) + sine * sine / std::max(ss, 1e-9));
}

struct Peak {
  Wave wave;
  double power;
};

/// The periodogram along the frequencies of one pair of wave numbers, by recurrence.
Peak best_frequency(const std::vector<Point>& points, double kx, double ky, double step_w, int steps) {
  using Complex = std::complex<double>;
  std::vector<Complex> at(points.size()), by(points.size());
  double information = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Point& p = points[i];
    at[i] = std::polar(p.score, kx * p.x_mm + ky * p.y_mm + steps * step_w * p.time_s);
    by[i] = std::polar(1.0, -step_w * p.time_s);
    information += p.information / 2;
  }
  Peak best{{kx, ky, 0}, 0};
  for (int j = -steps; j <= steps; ++j) {
    Complex sum = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      sum += at[i];
      at[i] *= by[i];
    }
    // A wave that stands still is a map; robots and biases absorb what is constant.
    if (j == 0) continue;
    const double power = 0.5 * std::norm(sum) / std::max(information, 1e-9);
    if (power > best.power) best = {{kx, ky, j * step_w}, power};
  }
  return best;
}

Peak climbed(const std::vector<Point>& points, Peak peak, const Wave& step) {
  peak.power = power_of(points, peak.wave);
  int steps = 0;
  for (double part = 0.5; part > 0.02; part /= 2) {
    for (bool better = true; better && steps < kMostSteps; ++steps) {
      better = false;
      for (std::size_t d = 0; d < 3; ++d) {
        for (const double sign : {1.0, -1.0}) {
          Wave trial = peak.wave;
          trial[d] += sign * part * step[d];
          const double power = power_of(points, trial);
          if (power <= peak.power) continue;
          peak = {trial, power};
          better = true;
        }
      }
    }
  }
  return peak;
}

/// Spacing of the wave numbers and frequencies, and how many there are to each side of 0.
struct Raster {
  Wave step;
  int across, up, steps;
};

/// Where the raster would be too large, as in a large room or a long run, the shortest wavelength and period rise together.
Raster raster_of(double width_mm, double height_mm, double duration_s, std::size_t points) {
  const Wave step{kSpacing * 2 * M_PI / std::max(width_mm, 1.0), kSpacing * 2 * M_PI / std::max(height_mm, 1.0),
                  kSpacing * 2 * M_PI / duration_s};
  for (double longer = 1;; longer *= 1.1) {
    const double across = std::floor(2 * M_PI / (longer * kShortest_mm) / step[0]),
                 up = std::floor(2 * M_PI / (longer * kShortest_mm) / step[1]),
                 steps = std::floor(2 * M_PI / (longer * kShortest_s) / step[2]);
    if ((2 * across + 1) * (up + 1) * (2 * steps + 1) * static_cast<double>(points) <= kMostTerms)
      return {step, static_cast<int>(across), static_cast<int>(up), static_cast<int>(steps)};
  }
}

/// The wave of a term that is one wave; null: another term.
Factor* wave_of(Term& term) {
  if (term.blocks.size() != 1 || term.blocks.front().basis.factors.size() != 1) return nullptr;
  Factor& f = term.blocks.front().basis.factors.front();
  return f.shape == Factor::Shape::kTravelling && f.known.empty() ? &f : nullptr;
}

/// The derivative of a fitted wave by its phase.
Factor derivative_of(const Factor& wave, const Basis& basis, const Eigen::VectorXd& coefficients) {
  Factor slope = wave;
  slope.known.assign(wave.columns(), 0);
  for (Eigen::Index i = 0; i < coefficients.size(); ++i) {
    const std::size_t column =
        basis.chosen.empty() ? static_cast<std::size_t>(i) : basis.chosen[static_cast<std::size_t>(i)];
    const double k = wave.first + static_cast<double>(column / 2);
    // cos(k p) has the derivative -k sin(k p), sin(k p) has k cos(k p).
    if (column % 2 == 0)
      slope.known[column + 1] -= k * coefficients[i];
    else
      slope.known[column - 1] += k * coefficients[i];
  }
  return slope;
}

/// A wave that moves by less than half a period in a run stands still if that is as likely: stripes of the floor. Returns
/// whether it does.
bool stand_still(const Fitter& fitter, FitState& state, std::size_t place, double duration_s, double likelihood) {
  constexpr double kMostLost = 3;  // as the choice of one number costs
  if (std::abs(wave_of(state.model.terms[place])->points[2]) * duration_s > M_PI) return false;
  FitState trial = state;
  Term& term = trial.model.terms[place];
  wave_of(term)->points[2] = 0;
  term.name = "speed-by-position";
  fitter.fit(trial, 2);
  if (!(fitter.log_likelihood(trial) > likelihood - kMostLost)) return false;
  state = std::move(trial);
  return true;
}

}  // namespace

bool refine_wave_numbers(const Fitter& fitter, FitState& state, std::size_t place) {
  constexpr int kMostPasses = 6;
  constexpr double kSettled = 1;
  if (wave_of(state.model.terms[place]) == nullptr) return false;
  const Extent extent = extent_of(state.tracks);
  const std::array<Factor, 3> along{
      over(Factor::Shape::kLinear, Covariate::kX, extent.x_low_mm, extent.x_high_mm, 1),
      over(Factor::Shape::kLinear, Covariate::kY, extent.y_low_mm, extent.y_high_mm, 1),
      over(Factor::Shape::kLinear, Covariate::kTime, 0, extent.duration_s, 1)};
  bool changed = false;
  double likelihood = fitter.log_likelihood(state);
  for (int pass = 0; pass < kMostPasses; ++pass) {
    Term& term = state.model.terms[place];
    const Block& block = term.blocks.front();
    const Factor slope = derivative_of(*wave_of(term), block.basis, term.coefficients);
    std::vector<Block> blocks;
    for (const Factor& covariate : along) blocks.push_back({block.target, Basis{{covariate, slope}}, block.during});
    const LocalQuadratic l = local_quadratic(fitter, state, state.model.terms.size(), blocks, true);
    Eigen::MatrixXd information = l.information;
    information.diagonal() += l.prior;
    const Eigen::Vector3d step = information.ldlt().solve(l.score).tail<3>();
    bool better = false;
    for (const double length : {1.0, 0.4, 0.16}) {
      FitState trial = state;
      std::vector<double>& numbers = wave_of(trial.model.terms[place])->points;
      for (std::size_t d = 0; d < numbers.size(); ++d)
        numbers[d] +=
            (d == 2 ? -1 : 1) * length * step[static_cast<Eigen::Index>(d)] / (along[d].high - along[d].low);
      fitter.fit(trial, 2);
      const double found = fitter.log_likelihood(trial);
      // Negated, so that a likelihood that is no number is no progress.
      if (!(found > likelihood + kSettled)) continue;
      likelihood = found;
      state = std::move(trial);
      better = changed = true;
      break;
    }
    if (!better) break;
  }
  return stand_still(fitter, state, place, extent.duration_s, likelihood) || changed;
}

Dictionary wave_dictionary_of(const Fitter& fitter, const FitState& state, const Extent& extent) {
  Dictionary dictionary;
  DictionaryBuilder make(dictionary);
  const std::vector<Point> points = points_of(fitter, state);
  const double width_mm = extent.x_high_mm - extent.x_low_mm, height_mm = extent.y_high_mm - extent.y_low_mm;
  constexpr std::size_t kFewest = 500;
  if (points.size() >= kFewest && extent.duration_s > 2 * kShortest_s) {
    const auto [step, across, up, steps] = raster_of(width_mm, height_mm, extent.duration_s, points.size());
    // Opposite wave numbers with the opposite frequency are the same wave.
    std::vector<std::pair<double, double>> numbers;
    for (int j = 0; j <= up; ++j)
      for (int i = j == 0 ? 1 : -across; i <= across; ++i) numbers.emplace_back(i * step[0], j * step[1]);
    std::vector<Peak> peaks(numbers.size());
    os::in_parallel(numbers.size(), fitter.threads(), [&](std::size_t i) {
      peaks[i] = best_frequency(points, numbers[i].first, numbers[i].second, step[2], steps);
    });
    std::stable_sort(peaks.begin(), peaks.end(), [](const Peak& a, const Peak& b) { return a.power > b.power; });
    peaks.resize(std::min(peaks.size(), kPeaks));
    os::in_parallel(peaks.size(), fitter.threads(),
                    [&](std::size_t i) { peaks[i] = climbed(points, peaks[i], step); });
    const double choices = static_cast<double>(numbers.size()) * 2 * steps;
    for (const Peak& peak : peaks) {
      Factor wave;
      wave.shape = Factor::Shape::kTravelling;
      wave.axis.of = Covariate::kX;
      wave.and_axis.of = Covariate::kY;
      wave.count = 2;
      wave.points.assign(peak.wave.begin(), peak.wave.end());
      const auto bases = make.put(kSpeed, Basis{{wave}});
      for (const Eigen::Index size : {2, 4})
        make.add(kSpeed, "position-and-time", {"position", "time"}, some(bases, 0, size), choices);
    }
  }
  make.finish();
  return dictionary;
}

}  // namespace kilotwin::identify
