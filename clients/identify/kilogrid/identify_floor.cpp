#include "clients/identify/kilogrid/identify_floor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "clients/identify/kilogrid/cell_filter.hpp"
#include "clients/identify/kilogrid/floor_classifier.hpp"
#include "clients/identify/kilogrid/floor_fit.hpp"
#include "core/base/error.hpp"

namespace kilotwin::kilogrid {
namespace {

using identify::Identified, identify::Options;
using nlohmann::json;

/// What an effect has to remove of the misfit to be tried: some 3 per parameter would be chance.
constexpr double kLeastGain = 15;
constexpr std::size_t kMostAdded = 3, kRoundsOfEffects = 2;
/// Robots and time that predictions are made for: some of each run held out.
constexpr std::size_t kPredictedRobots = 10, kParticles = 80;
constexpr double kPredicted_s = 1500;
constexpr const char* kWall = "wall";

struct Judged {
  double sum = 0, log_likelihood = 0;
  std::size_t rows = 0, reports = 0;
  std::vector<std::pair<double, double>> by_robot;  ///< squared errors, rows

  [[nodiscard]] double rmse_mm() const { return rows > 0 ? std::sqrt(sum / static_cast<double>(rows)) : 0; }
};

struct Predicted {
  std::string run;
  std::uint32_t robot;
  CellPrediction at;
};

Judged judge(const std::vector<FloorRun>& runs, const Floor& floor, const FloorSettings& settings, double horizon_s,
             std::vector<Predicted>* all) {
  Judged judged;
  for (const FloorRun& run : runs) {
    const std::size_t stride = std::max<std::size_t>(run.tracks.size() / kPredictedRobots, 1);
    for (std::size_t i = stride / 2; i < run.tracks.size(); i += stride) {
      FloorTrack track = run.tracks[i];
      while (track.size() > 1 && track.time_s.back() > kPredicted_s) {
        track.time_s.pop_back();
        track.x_mm.pop_back();
        track.y_mm.pop_back();
      }
      const CellFilterResult result = filter_cells(track, floor, settings, horizon_s, kParticles, 17 * i + 5);
      judged.log_likelihood += result.log_likelihood;
      judged.reports += result.reports;
      double sum = 0;
      for (const CellPrediction& p : result.predictions) {
        const double dx = p.x_mm - p.measured_x_mm, dy = p.y_mm - p.measured_y_mm;
        sum += dx * dx + dy * dy;
        if (all != nullptr) all->push_back({run.name, track.robot, p});
      }
      judged.sum += sum;
      judged.rows += result.predictions.size();
      judged.by_robot.emplace_back(sum, static_cast<double>(result.predictions.size()));
    }
  }
  return judged;
}

json summary_of(const Judged& judged) {
  const auto n = static_cast<double>(std::max<std::size_t>(judged.rows, 1));
  const double mean = judged.sum / n;
  double spread = 0;
  for (const auto& [sum, count] : judged.by_robot) spread += (sum - mean * count) * (sum - mean * count);
  const double half = 1.96 * std::sqrt(spread) / n;
  return {{"rmse_mm", judged.rmse_mm()},
          {"rmse_low_mm", std::sqrt(std::max(mean - half, 0.0))},
          {"rmse_high_mm", std::sqrt(mean + half)},
          {"rows", judged.rows},
          {"log_likelihood_per_report",
           judged.log_likelihood / static_cast<double>(std::max<std::size_t>(judged.reports, 1))}};
}

json numbers(const std::vector<double>& values, const StatisticGroup& group, bool root) {
  json list = json::array();
  for (std::size_t s = group.first; s < group.first + group.size(); ++s) {
    const double v = root ? std::sqrt(values[s]) : values[s];
    list.push_back(std::isfinite(v) ? json(v) : json());
  }
  return list;
}

/// What simulated runs leave of the measured speed over one covariate, in mm/s, as the report shows it.
json plot_of(const char* name, const char* covariate, const char* unit, const std::vector<double>& at,
             const FloorTarget& target, const FloorStatistics& before, const FloorStatistics& after) {
  const StatisticGroup& group = statistic_group(name);
  json plot = {{"target", "forward"},
               {"covariate", covariate},
               {"unit", unit},
               {"acts_on_unit", "mm/s"},
               {"fitted", nullptr}};
  for (const char* list : {"at", "before", "before_se", "after"}) plot[list] = json::array();
  for (std::size_t i = 0; i < std::min(at.size(), group.size()); ++i) {
    const std::size_t s = group.first + i;
    const double measured = target.statistics().value[s];
    if (!std::isfinite(measured + before.value[s] + after.value[s])) continue;
    plot["at"].push_back(at[i]);
    plot["before"].push_back((measured - before.value[s]) / FloorBlocks::kBlock_s);
    plot["before_se"].push_back(std::sqrt(target.statistics().variance[s]) / FloorBlocks::kBlock_s);
    plot["after"].push_back((measured - after.value[s]) / FloorBlocks::kBlock_s);
  }
  return plot;
}

std::vector<double> middles(double first, double step, std::size_t count) {
  std::vector<double> at;
  for (std::size_t i = 0; i < count; ++i) at.push_back(first + step * static_cast<double>(i));
  return at;
}

json map_of(const FloorTarget& target, const FloorStatistics& before, const FloorStatistics& after) {
  const StatisticGroup& group = statistic_group("step-by-place");
  constexpr std::size_t kColumns = 4;
  const std::size_t rows = group.size() / kColumns;
  const double width = target.floor().width_mm / kColumns,
               height = target.floor().height_mm / static_cast<double>(rows);
  json map = {{"target", "forward"},
              {"unit", "mm/s"},
              {"x_mm", middles(0.5 * width - target.floor().width_mm / 2, width, kColumns)},
              {"y_mm", middles(0.5 * height - target.floor().height_mm / 2, height, rows)}};
  for (std::size_t r = 0; r < rows; ++r) {
    json b = json::array(), a = json::array(), n = json::array();
    for (std::size_t c = 0; c < kColumns; ++c) {
      const std::size_t s = group.first + r * kColumns + c;
      const double measured = target.statistics().value[s];
      b.push_back((measured - before.value[s]) / FloorBlocks::kBlock_s);
      a.push_back((measured - after.value[s]) / FloorBlocks::kBlock_s);
      n.push_back(1);
    }
    map["before"].push_back(b);
    map["after"].push_back(a);
    map["count"].push_back(n);
  }
  return map;
}

/// A row of shares as a distribution of 10 000.
json distribution_of(const char* name, const char* title, const char* unit, const std::vector<double>& edges,
                     const FloorTarget& target, const FloorStatistics& simulated) {
  const StatisticGroup& group = statistic_group(name);
  json d = {
      {"name", title}, {"unit", unit}, {"edges", edges}, {"measured", json::array()}, {"simulated", json::array()}};
  for (std::size_t s = group.first; s < group.first + group.size(); ++s) {
    d["measured"].push_back(std::round(10000 * target.statistics().value[s]));
    d["simulated"].push_back(std::round(10000 * simulated.value[s]));
  }
  return d;
}

/// How well simulated runs pass for measured ones, on the days held out, and measured ones of other days for each other.
json classify(const std::vector<FloorRun>& train, const std::vector<FloorRun>& test, const FloorTarget& held_out,
              const FloorSettings& before, const FloorSettings& after) {
  const Floor& floor = held_out.floor();
  std::vector<std::vector<TrackWindow>> measured, others;
  for (const FloorRun& run : test) measured.push_back(windows_of(run, floor));
  for (const FloorRun& run : train) others.push_back(windows_of(run, floor));
  double between = 0, pairs = 0;
  for (std::size_t i = 0; i < measured.size(); ++i) {
    for (std::size_t j = 0; j < measured.size() + others.size(); ++j) {
      if (j <= i && j < measured.size()) continue;
      between += tell_apart(measured[i], j < measured.size() ? measured[j] : others[j - measured.size()]).best();
      ++pairs;
    }
  }
  json runs = json::array();
  double sum_before = 0, sum_after = 0;
  const std::vector<FloorRun> by_before = simulate_scenes(held_out, before, 901),
                              by_after = simulate_scenes(held_out, after, 902);
  for (std::size_t i = 0; i < measured.size(); ++i) {
    const TellApart b = tell_apart(measured[i], windows_of(by_before[i], floor)),
                    a = tell_apart(measured[i], windows_of(by_after[i], floor));
    sum_before += b.best();
    sum_after += a.best();
    runs.push_back({{"run", test[i].name},
                    {"before", b.best()},
                    {"after", a.best()},
                    {"after_logistic", a.logistic},
                    {"after_boosted", a.boosted}});
  }
  const auto n = static_cast<double>(std::max<std::size_t>(measured.size(), 1));
  return {{"measured", pairs > 0 ? between / pairs : 0.5},
          {"before", sum_before / n},
          {"after", sum_after / n},
          {"runs", runs},
          {"features", feature_names()}};
}

std::string words_of(const FloorModel& model, std::size_t term) {
  const FloorTerm& t = model.terms[term];
  std::string text = fmt::format("{} on {}:", t.covariates.empty() ? "constant" : t.covariates.front(), t.acts_on);
  for (std::size_t p = 0; p < t.parameters.size(); ++p)
    text += fmt::format(" {} {:.3g}", t.parameters[p].name, model.values[model.first_of(term) + p]);
  return text;
}

std::string words_of_wall(const FloorModel& model) {
  const auto& wall = *model.wall;
  const auto [slowest, fastest] = std::minmax_element(wall.begin(), wall.end());
  return fmt::format(
      "within {:.0f} mm of the wall robots go at {:.2f} to {:.2f} of their speed, by where along the rim",
      FloorModel::kBeside_mm, *slowest, *fastest);
}

/// The effects that are in the model, as what can be left out: terms, and the walls as the last.
FloorModel without(const FloorModel& model, std::size_t effect) {
  if (effect + 1 < model.terms.size()) return model.without(effect + 1);
  FloorModel less = model;
  less.wall.reset();
  return less;
}
std::size_t effects_of(const FloorModel& model) { return model.terms.size() - 1 + (model.wall ? 1 : 0); }
std::string name_of(const FloorModel& model, std::size_t effect) {
  return effect + 1 < model.terms.size() ? model.terms[effect + 1].name : kWall;
}

}  // namespace

Identified identify_floor(std::vector<FloorRun> train, std::vector<FloorRun> test, const Options& options) {
  const auto started = std::chrono::steady_clock::now();
  if (test.empty()) {
    std::vector<FloorRun> kept;
    for (std::size_t r = 0; r < train.size(); ++r)
      (train.size() > 1 && r % 3 == 1 ? test : kept).push_back(std::move(train[r]));
    train = std::move(kept);
  }
  if (train.empty() || test.empty() || train.front().tracks.empty())
    throw UserError("a floor's runs are learned from and judged by others; give at least two, or --test DIR");
  double part = 0;
  const FloorProgress progress = [&](const std::string& what) {
    if (options.progress) options.progress(part, what);
  };
  const Floor floor;
  const FloorTarget learned(train, floor, options.threads), held_out(test, floor, options.threads);
  json steps = json::array();
  const auto note = [&](const std::string& added, const FloorModel& model) {
    const double misfit = held_out.misfit(simulated_statistics(held_out, model.settings(), 4711, 2));
    steps.push_back({{"added", added}, {"held_out_misfit", misfit}});
    progress(fmt::format("{}: misfit on runs held out {:.0f} of {} statistics", added, misfit, held_out.size()));
  };

  FloorModel model;
  model.add(base_term());
  part = 0.02;
  fit(model, learned, 2, 1, 1, progress);
  const FloorModel base = model;
  note("base", model);

  std::vector<FloorTerm> candidates = candidate_terms(floor);
  json tried = json::array();
  if (options.trace) {
    part = 0.2;
    fit_walls(model, learned, 5, 3000, progress);
    note(kWall, model);
    for (std::size_t round = 0; round < kRoundsOfEffects; ++round) {
      part = 0.25 + 0.25 * static_cast<double>(round);
      std::vector<CandidateScore> chosen = choose(model, candidates, learned, kLeastGain, 50 + round, progress);
      if (chosen.empty()) break;
      chosen.resize(std::min(chosen.size(), kMostAdded));
      std::string names;
      std::vector<std::size_t> taken;
      for (const CandidateScore& score : chosen) {
        model.add(candidates[score.candidate]);
        std::copy(score.values.begin(), score.values.end(),
                  model.values.end() - static_cast<std::ptrdiff_t>(score.values.size()));
        names += (names.empty() ? "" : ", ") + candidates[score.candidate].name;
        tried.push_back({{"name", candidates[score.candidate].name}, {"misfit_gain", score.gain}});
        taken.push_back(score.candidate);
      }
      std::sort(taken.rbegin(), taken.rend());
      for (const std::size_t c : taken) candidates.erase(candidates.begin() + static_cast<std::ptrdiff_t>(c));
      fit(model, learned, 2, 0.8, 100 + round, progress);
      fit_walls(model, learned, 3, 6000 + 10 * round, progress);
      note(names, model);
    }
  }

  // Each effect must earn its place on the runs held out.
  part = 0.75;
  json effects = json::array(), rejected = json::array(), ambiguous = json::array();
  double with = held_out.misfit(simulated_statistics(held_out, model.settings(), 77, 2));
  for (std::size_t e = effects_of(model); e-- > 0;) {
    const FloorModel less = without(model, e);
    const double misfit = held_out.misfit(simulated_statistics(held_out, less.settings(), 77, 2));
    progress(fmt::format("without {}: misfit {:.0f} against {:.0f}", name_of(model, e), misfit, with));
    if (misfit > with) continue;
    rejected.push_back({{"name", name_of(model, e)},
                        {"covariates", e + 1 < model.terms.size() ? model.terms[e + 1].covariates
                                                                  : std::vector<std::string>{"position"}},
                        {"why", "runs held out fit no worse without it"}});
    model = less;
    with = misfit;
  }
  for (const FloorTerm& candidate : candidates)
    rejected.push_back({{"name", candidate.name},
                        {"covariates", candidate.covariates},
                        {"acts_on", candidate.acts_on},
                        {"why", "would gain too little"}});

  part = 0.85;
  progress("predictions");
  std::vector<Predicted> by_base, by_model;
  const Judged before = judge(test, floor, base.settings(), options.horizon_s, &by_base),
               after = judge(test, floor, model.settings(), options.horizon_s, &by_model);
  const FloorStatistics out_before = simulated_statistics(held_out, base.settings(), 78, 2),
                        out_after = simulated_statistics(held_out, model.settings(), 79, 2);
  const double misfit_before = held_out.misfit(out_before), misfit_after = held_out.misfit(out_after);
  for (std::size_t e = 0; e < effects_of(model); ++e) {
    const FloorModel less = without(model, e);
    const bool is_wall = name_of(model, e) == kWall;
    const double misfit = held_out.misfit(simulated_statistics(held_out, less.settings(), 79, 2));
    const Judged lesser = judge(test, floor, less.settings(), options.horizon_s, nullptr);
    json parameters;
    if (is_wall) {
      parameters = {{"form", "steps"}, {"beside_mm", FloorModel::kBeside_mm}, {"part_of_speed", *model.wall}};
    } else {
      parameters["form"] = "record of the model";
      for (std::size_t p = 0; p < model.terms[e + 1].parameters.size(); ++p)
        parameters[model.terms[e + 1].parameters[p].name] = model.values[model.first_of(e + 1) + p];
      if (!model.terms[e + 1].experiment.empty())
        ambiguous.push_back({{"found", name_of(model, e)},
                             {"instead", "see experiment"},
                             {"experiment", model.terms[e + 1].experiment}});
    }
    effects.push_back(
        {{"name", name_of(model, e)},
         {"covariates", is_wall ? std::vector<std::string>{"position"} : model.terms[e + 1].covariates},
         {"acts_on", is_wall ? "WHEEL_GAIN" : model.terms[e + 1].acts_on},
         {"evidence",
          {{"held_out_misfit_without", misfit},
           {"held_out_misfit", misfit_after},
           {"log_likelihood_gain", after.log_likelihood - lesser.log_likelihood}}},
         {"parameters", parameters},
         {"rmse_without_mm", lesser.rmse_mm()},
         {"share_removed", (misfit - misfit_after) / std::max(misfit_before - misfit_after, 1e-9)},
         {"in_words", is_wall ? words_of_wall(model) : words_of(model, e + 1)}});
    progress(fmt::format("{}: misfit {:.0f} without it, {:.0f} with it", name_of(model, e), misfit, misfit_after));
  }
  if (model.wall)
    ambiguous.push_back({{"found", kWall},
                         {"instead", "messages of the rim that make robots turn away for longer at some places"},
                         {"experiment", "let robots drive along the wall with the rim's messages switched off"}});
  std::stable_sort(effects.begin(), effects.end(),
                   [](const json& a, const json& b) { return a["share_removed"] > b["share_removed"]; });

  part = 0.95;
  progress("classifier");
  json statistics = json::array();
  for (const StatisticGroup& group : statistic_groups()) {
    const bool root = group.name == "msd";
    std::vector<double> sd(statistic_count());
    for (std::size_t s = 0; s < sd.size(); ++s) sd[s] = std::sqrt(held_out.tolerance()[s]);
    statistics.push_back({{"name", group.name},
                          {"covariate", group.covariate},
                          {"labels", group.labels},
                          {"measured", numbers(held_out.statistics().value, group, root)},
                          {"tolerance", root ? json() : numbers(sd, group, false)},
                          {"before", numbers(out_before.value, group, root)},
                          {"after", numbers(out_after.value, group, root)},
                          {"misfit_before", held_out.misfit(out_before, group)},
                          {"misfit_after", held_out.misfit(out_after, group)}});
  }
  json faults = json::array();
  for (const auto* set : {&train, &test}) {
    for (const FloorRun& run : *set) {
      for (const FloorFault& fault : run.faults) {
        faults.push_back({{"kind", fault.reason.starts_with("in two") ? "duplicated" : "silent"},
                          {"run", run.name},
                          {"robot", fault.robot},
                          {"in_words", fault.reason}});
      }
    }
  }

  Identified result;
  const FloorSettings settings = model.settings();
  result.model = settings.model;
  for (std::size_t i = 0; i < std::min(by_base.size(), by_model.size()); ++i) {
    const Predicted &b = by_base[i], &a = by_model[i];
    result.predictions.push_back({b.run, b.robot, b.at.time_s, b.at.x_mm, b.at.y_mm, a.at.x_mm, a.at.y_mm});
  }
  json summary_before = summary_of(before), summary_after = summary_of(after);
  summary_before["misfit"] = misfit_before;
  summary_after["misfit"] = misfit_after;
  json& contract = result.document["contract"];
  contract = {{"before", summary_before},
              {"after", summary_after},
              {"noise_floor_mm", cell_noise_mm(floor, settings.radio)},
              {"noise_floor_how",
               "how far robots are from the middle of cells that hear them: what the place itself, known exactly, "
               "would leave"},
              {"horizon_s", options.horizon_s},
              {"effects", effects},
              {"rejected", rejected},
              {"ambiguous", ambiguous},
              {"faults", faults},
              {"statistics", statistics},
              {"classifier", classify(train, test, held_out, base.settings(), settings)}};
  const auto parameters = base_term().parameters;
  for (std::size_t p = 0; p < parameters.size(); ++p)
    contract[p < 4 ? "base" : "floor"][parameters[p].name] = model.values[p];
  contract["floor"]["cell_later"] = settings.radio.later;
  result.document["set"] = {
      {"train", train.size()}, {"test", test.size()}, {"has_headings", false}, {"has_commands", false}};
  result.document["steps"] = steps;
  const StatisticGroup& ways = statistic_group("msd");
  json measured = json::array(), simulated = json::array(), lags = json::array();
  for (std::size_t s = 0; s < ways.size(); ++s) {
    measured.push_back(held_out.statistics().value[ways.first + s]);
    simulated.push_back(out_after.value[ways.first + s]);
    lags.push_back(std::array{10, 20, 50, 100, 200, 300, 600}[s]);
  }
  result.document["msd"] = {{"lag_s", lags}, {"measured_mm2", measured}, {"simulated_mm2", simulated}};
  const double pi = 3.14159265358979;
  result.document["covariate_plots"] = {
      plot_of("step-by-time", "time", "s", middles(150, 300, 16), held_out, out_before, out_after),
      plot_of("step-by-wall", "position", "mm from the wall", {20, 45, 55, 67, 87, 125, 175, 250, 400}, held_out,
              out_before, out_after),
      plot_of("step-by-neighbours", "neighbours", "within 100 mm", middles(0, 1, 5), held_out, out_before,
              out_after),
      plot_of("step-by-direction", "heading", "rad", middles(-7 * pi / 8, pi / 4, 8), held_out, out_before,
              out_after)};
  result.document["maps"] = {map_of(held_out, out_before, out_after)};
  result.document["distributions"] = {
      distribution_of("step", "way in 10 s", "mm",
                      {0, 8, 16, 24, 32, 40, 50, 60, 70, 80, 90, 100, 110, 120, 150, 200}, held_out, out_after),
      distribution_of("turn", "turn between two ways of 10 s", "rad", middles(0, pi / 8, 9), held_out, out_after)};
  result.document["robots"] = json::array();
  result.document["seconds"]["all"] =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  part = 1;
  progress("done");
  return result;
}

}  // namespace kilotwin::kilogrid
