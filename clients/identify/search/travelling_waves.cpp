#include "clients/identify/search/travelling_waves.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdint>
#include <utility>

#include "clients/identify/search/dictionary_builder.hpp"
#include "clients/identify/search/number_steps.hpp"
#include "clients/identify/search/phasor_sums.hpp"
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

struct Peak {
  Wave wave;
  double power;
};

/// exp(i number value) of all points. Sines and cosines of many waves would take most of the search's time: their raster and their
/// ascent need products of few such columns only.
using Phasors = Eigen::ArrayXcd;
template <class Value> Phasors phasors(const std::vector<Point>& points, double number, Value&& value) {
  Phasors all(static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i)
    all[static_cast<Eigen::Index>(i)] = std::polar(1.0, number * value(points[i]));
  return all;
}
double x_of(const Point& p) { return p.x_mm; }
double y_of(const Point& p) { return p.y_mm; }
double less_time_of(const Point& p) { return -p.time_s; }

/// Half the sum of squares that a wave explains.
double power_of(const std::vector<Point>& points, const Phasors& at) {
  double cosine = 0, sine = 0, cc = 0, all = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Point& p = points[i];
    const double c = at[static_cast<Eigen::Index>(i)].real(), s = at[static_cast<Eigen::Index>(i)].imag();
    cosine += p.score * c;
    sine += p.score * s;
    cc += p.information * c * c;
    all += p.information;
  }
  return 0.5 * (cosine * cosine / std::max(cc, 1e-9) + sine * sine / std::max(all - cc, 1e-9));
}

Peak climbed(const std::vector<Point>& points, Peak peak, const Wave& step) {
  Phasors at = phasors(points, peak.wave[0], x_of) * phasors(points, peak.wave[1], y_of) *
               phasors(points, peak.wave[2], less_time_of);
  peak.power = power_of(points, at);
  int steps = 0;
  double part = 0.5;
  while (part > 0.02) {
    const std::array<Phasors, 3> by{phasors(points, part * step[0], x_of), phasors(points, part * step[1], y_of),
                                    phasors(points, part * step[2], less_time_of)};
    for (bool better = true; better && steps < kMostSteps; ++steps) {
      better = false;
      for (std::size_t d = 0; d < 3; ++d) {
        for (const double sign : {1.0, -1.0}) {
          Phasors trial = sign > 0 ? Phasors(at * by[d]) : Phasors(at * by[d].conjugate());
          const double power = power_of(points, trial);
          if (power <= peak.power) continue;
          peak.wave[d] += sign * part * step[d];
          peak.power = power;
          at.swap(trial);
          better = true;
        }
      }
    }
    part /= 2;
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
  double longer = 1;
  while (true) {
    const double across = std::floor(2 * M_PI / (longer * kShortest_mm) / step[0]),
                 up = std::floor(2 * M_PI / (longer * kShortest_mm) / step[1]),
                 steps = std::floor(2 * M_PI / (longer * kShortest_s) / step[2]);
    if ((2 * across + 1) * (up + 1) * (2 * steps + 1) * static_cast<double>(points) <= kMostTerms)
      return {step, static_cast<int>(across), static_cast<int>(up), static_cast<int>(steps)};
    longer *= 1.1;
  }
}

/// The periodogram of the points on a raster.
class Periodogram {
 public:
  Periodogram(const std::vector<Point>& points, const Raster& raster)
      : raster_(raster), by_(phasors(points, raster.step[2], less_time_of)) {
    for (int i = 0; i <= raster.across; ++i) along_x_.push_back(phasors(points, i * raster.step[0], x_of));
    for (int j = 0; j <= raster.up; ++j) along_y_.push_back(phasors(points, j * raster.step[1], y_of));
    start_ = phasors(points, -raster.steps * raster.step[2], less_time_of);
    double information = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      start_[static_cast<Eigen::Index>(i)] *= points[i].score;
      information += points[i].information / 2;
    }
    information_ = std::max(information, 1e-9);
  }
  /// The best frequency of wave numbers i and j of the raster, by recurrence.
  [[nodiscard]] Peak best_frequency(int i, int j) const {
    const Phasors& x = along_x_[static_cast<std::size_t>(std::abs(i))];
    Phasors at = start_ * along_y_[static_cast<std::size_t>(j)];
    if (i < 0)
      at *= x.conjugate();
    else
      at *= x;
    Peak best{{i * raster_.step[0], j * raster_.step[1], 0}, 0};
    std::vector<std::complex<double>> sums(2 * static_cast<std::size_t>(raster_.steps) + 1);
    add_phasor_sums(at, by_, sums);
    for (int w = -raster_.steps; w <= raster_.steps; ++w) {
      const double power =
          0.5 * std::norm(sums[static_cast<std::size_t>(std::int64_t{w} + raster_.steps)]) / information_;
      // A wave that stands still is a map; robots and biases absorb what is constant.
      if (w == 0 || power <= best.power) continue;
      best.wave[2] = w * raster_.step[2];
      best.power = power;
    }
    return best;
  }

 private:
  const Raster raster_;
  const Phasors by_;  ///< one frequency further
  std::vector<Phasors> along_x_, along_y_;
  Phasors start_;  ///< scores at the lowest frequency
  double information_ = 0;
};

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
    const std::size_t harmonic = column / 2;
    const double k = wave.first + static_cast<double>(harmonic);
    // cos(k p) has the derivative -k sin(k p), sin(k p) has k cos(k p).
    if (column % 2 == 0)
      slope.known[column + 1] -= k * coefficients[i];
    else
      slope.known[column - 1] += k * coefficients[i];
  }
  return slope;
}

/// A wave that moves by less than half a period in a run stands still if that is as likely: stripes of the floor. One that hardly moves
/// may also fit what its harmonics lack: then, standing, it may lose a share of what it explains, as a circle may. Returns whether it
/// stands.
bool stand_still(const Fitter& fitter, FitState& state, std::size_t place, double duration_s, double likelihood) {
  constexpr double kPerNumber = 3;                     // as the choice of one number costs
  constexpr double kShare = 0.05, kHardly = 1.0 / 12;  // of what it explains; of a period in a run
  const double moved_rad = std::abs(wave_of(state.model.terms[place])->points[2]) * duration_s;
  if (moved_rad > M_PI) return false;
  double may_lose = kPerNumber;
  if (moved_rad < kHardly * 2 * M_PI) {
    FitState without = state;
    without.model.terms.erase(without.model.terms.begin() + static_cast<std::ptrdiff_t>(place));
    may_lose = std::max(may_lose, kShare * (likelihood - fitter.fit_for_likelihood(without, 1)));
  }
  FitState trial = state;
  Term& term = trial.model.terms[place];
  wave_of(term)->points[2] = 0;
  term.name = effect_name(kSpeed, "position");
  if (!(fitter.fit_for_likelihood(trial, 2) > likelihood - may_lose)) return false;
  state = std::move(trial);
  return true;
}

}  // namespace

bool refine_wave_numbers(const Fitter& fitter, FitState& state, std::size_t place) {
  if (wave_of(state.model.terms[place]) == nullptr) return false;
  const Extent extent = extent_of(state.tracks);
  const std::array<Factor, 3> along{
      over(Factor::Shape::kLinear, Covariate::kX, extent.x_low_mm, extent.x_high_mm, 1),
      over(Factor::Shape::kLinear, Covariate::kY, extent.y_low_mm, extent.y_high_mm, 1),
      over(Factor::Shape::kLinear, Covariate::kTime, 0, extent.duration_s, 1)};
  NumberSteps steps;
  steps.slopes = [&](const FitState& now) {
    const Term& term = now.model.terms[place];
    const Block& block = term.blocks.front();
    const Factor slope = derivative_of(block.basis.factors.front(), block.basis, term.coefficients);
    std::vector<Block> blocks;
    blocks.reserve(along.size());
    for (const Factor& covariate : along) blocks.push_back({block.target, Basis{{covariate, slope}}, block.during});
    return blocks;
  };
  steps.move = [&](FitState& trial, const Eigen::VectorXd& step) {
    std::vector<double>& numbers = wave_of(trial.model.terms[place])->points;
    for (std::size_t d = 0; d < numbers.size(); ++d)
      numbers[d] += (d == 2 ? -1 : 1) * step[static_cast<Eigen::Index>(d)] / (along[d].high - along[d].low);
  };
  double likelihood = fitter.log_likelihood(state);
  const bool changed = move_numbers(fitter, state, steps, likelihood);
  return stand_still(fitter, state, place, extent.duration_s, likelihood) || changed;
}

Dictionary wave_dictionary_of(const Fitter& fitter, const FitState& state, const Extent& extent) {
  Dictionary dictionary;
  DictionaryBuilder make(dictionary);
  const std::vector<Point> points = points_of(fitter, state);
  const double width_mm = extent.x_high_mm - extent.x_low_mm, height_mm = extent.y_high_mm - extent.y_low_mm;
  // Points; with fewer, no wave is sought; a smaller value finds more waves that are chance.
  constexpr std::size_t kFewest = 500;
  if (points.size() >= kFewest && extent.duration_s > 2 * kShortest_s) {
    const Raster raster = raster_of(width_mm, height_mm, extent.duration_s, points.size());
    // Opposite wave numbers with the opposite frequency are the same wave.
    std::vector<std::pair<int, int>> numbers;
    for (int j = 0; j <= raster.up; ++j)
      for (int i = j == 0 ? 1 : -raster.across; i <= raster.across; ++i) numbers.emplace_back(i, j);
    std::vector<Peak> peaks(numbers.size());
    const Periodogram periodogram(points, raster);
    os::in_parallel(numbers.size(), fitter.threads(), [&](std::size_t i) {
      peaks[i] = periodogram.best_frequency(numbers[i].first, numbers[i].second);
    });
    std::stable_sort(peaks.begin(), peaks.end(), [](const Peak& a, const Peak& b) { return a.power > b.power; });
    peaks.resize(std::min(peaks.size(), kPeaks));
    os::in_parallel(peaks.size(), fitter.threads(),
                    [&](std::size_t i) { peaks[i] = climbed(points, peaks[i], raster.step); });
    const double choices = static_cast<double>(numbers.size()) * 2 * raster.steps;
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
