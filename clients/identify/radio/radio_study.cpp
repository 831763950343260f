#include "clients/identify/radio/radio_study.hpp"

#include <fmt/format.h>
#include <google/protobuf/text_format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "clients/identify/radio/evidence.hpp"
#include "clients/identify/radio/grid_run.hpp"
#include "clients/identify/radio/link_fit.hpp"
#include "clients/identify/radio/link_intervals.hpp"
#include "clients/identify/radio/radio_words.hpp"
#include "clients/identify/radio/scores.hpp"
#include "clients/identify/result/result_json.hpp"
#include "clients/identify/result/values.hpp"
#include "clients/report/plot.hpp"
#include "core/base/error.hpp"
#include "core/base/say.hpp"
#include "core/os/worker_pool.hpp"
#include "core/random/random.hpp"
#include "core/stats/moments.hpp"
#include "core/stats/quantiles.hpp"
#include "idl/model.pb.h"

namespace kilotwin::radio_fit {
namespace {

using Radios = std::vector<proto::Radio>;  ///< one per set

/// 16 kilo_ticks of the nominal clock.
constexpr double kSixteenTicks_s = 16 * 0.032768;
constexpr std::uint64_t kFirstSeed = 1000, kFirstSwarm = 5000;
constexpr double kFar_mm = 125;

/// One effect, in addition to the previous ones.
struct Step {
  std::string name, added;
  std::vector<std::string> covariates;
  std::string evidence;
  identification::Evidence figures;
  std::vector<Errors> errors;  ///< per set
};

class RadioStudy final : public identify::Study {
 public:
  RadioStudy(const RadioData& data, const RadioWork& work, std::filesystem::path out, identify::Options options)
      : work_(work), out_(std::move(out)), options_(std::move(options)) {
    const std::vector<GridSet> all = read_grids(data.train);
    train_ = data.test.empty() ? half_of(all, data.swap) : all;
    test_ = data.test.empty() ? half_of(all, !data.swap) : read_grids(data.test);
    if (train_.size() != test_.size())
      throw UserError(fmt::format("{}: other sets than in {}; give runs of the same tau in both",
                                  data.test.string(), data.train.string()));
    for (const auto& sets : {train_, test_}) {
      for (const GridSet& set : sets) {
        if (set.runs.empty() || set.robots() != train_.front().robots())
          throw UserError(
              fmt::format("{}: {} has no run to spare, or another number of robots; give two runs of each "
                          "set at least",
                          data.train.string(), set.name));
      }
    }
  }
  /// The ARGoS model, and what its disc needs.
  void fit() override;
  /// The links' terms, then the packets and the clocks.
  void search() override;
  /// Each effect is judged when it is added; here the population.
  void judge() override { draw_population(); }
  identify::Identified report() override;

 private:
  void add(Step step, const Radios& radios);
  void add_links();
  void add_packets();
  void add_oscillators();
  void add_carrier_sense();
  void fit_oscillators(int rounds);
  void fit_wander();
  [[nodiscard]] LinkModel::Timing drawn() const;
  void draw_population();
  /// Reception of drawn swarms in the grid of set `q`, by displacement class; radio_of(k): of swarm k.
  template <class RadioOf>
  [[nodiscard]] std::vector<std::vector<double>> reception_of_swarms(std::size_t q, RadioOf&& radio_of) const;
  /// The placement that model.txtpb has.
  [[nodiscard]] const LinkModel::Swarm& steadiest() const;
  void write_placements() const;
  /// Returns the model of the population.
  [[nodiscard]] proto::Model write_models() const;
  [[nodiscard]] identification::RadioFit result() const;
  void write_tables(const identification::RadioFit&) const;
  void write_figures() const;
  [[nodiscard]] Radios alike(const proto::Radio& radio) const { return Radios(train_.size(), radio); }
  [[nodiscard]] Radios fitted(const LinkModel& model) const;

  const RadioWork work_;
  const std::filesystem::path out_;
  const identify::Options options_;
  std::vector<GridSet> train_, test_;
  std::vector<Step> steps_;
  LinkModel model_;
  LinkModel::Timing timing_;
  std::vector<identification::PopulationClass> population_;
};

std::string text_of(const Evidence& e) {
  return fmt::format("{}: {:.2f}, {:.2f} +- {:.2f} under permutation", e.what, e.explained, e.by_chance,
                     e.by_chance_sd);
}

identification::Evidence entry_of(const Evidence& e) {
  identification::Evidence out;
  out.set_what(e.what);
  out.set_value(e.explained);
  out.set_by_chance(e.by_chance);
  out.set_by_chance_sd(e.by_chance_sd);
  return out;
}

void RadioStudy::add(Step step, const Radios& radios) {
  for (std::size_t q = 0; q < train_.size(); ++q) {
    const GridSet simulated = simulate(train_[q], radios[q], work_.runs, kFirstSeed);
    step.errors.push_back(compare(test_[q], simulated, train_[q]));
  }
  const std::string shown = fmt::format("{}: {}", step.name, step.evidence);
  constexpr int kSteps = 14;  // with the population
  if (options_.progress) {
    const double left = std::max(0, kSteps - 2 - static_cast<int>(steps_.size()));
    options_.progress({fmt::format("after {}", shown), "", 0, 1, {{0, left, left}}});
  } else {
    say(shown);
  }
  steps_.push_back(std::move(step));
}

Radios RadioStudy::fitted(const LinkModel& model) const {
  Radios radios;
  for (const LinkModel::Swarm& swarm : model.swarms) radios.push_back(model.radio(swarm, timing_));
  return radios;
}

/// Mean difference of reception up to 105 mm over the sets.
double near_error(const std::vector<GridSet>& sets, const proto::Radio& radio) {
  double sum = 0;
  for (const GridSet& set : sets)
    sum += std::abs(statistics(simulate(set, radio, 4, kFirstSeed)).near - statistics(set).near);
  return sum;
}

void RadioStudy::fit() {
  model_ = fit_links(train_, Terms::kDistance);
  proto::Radio radio;
  radio.set_model(proto::Radio::SIMPLE);
  radio.set_range_mm(model_.range_mm);
  const auto tune = [&] {
    double best = 1e9, contention = 1;
    for (const double tried : {0.0, 0.05, 0.1, 0.2, 0.4, 1.0}) {
      radio.mutable_simple()->set_contention(tried);
      const double error = near_error(train_, radio);
      if (error < best) {
        best = error;
        contention = tried;
      }
    }
    radio.mutable_simple()->set_contention(contention);
  };
  tune();
  add({"ARGoS model",
       fmt::format("2 Hz, sending error 0.008, range {:.0f} mm, contention {:.2f}: tuned to the mean "
                   "reception",
                   model_.range_mm, radio.simple().contention()),
       {},
       "-",
       {},
       {}},
      alike(radio));
  double sent = 0;
  for (const GridSet& set : train_) sent += statistics(set).sent / static_cast<double>(train_.size());
  radio.mutable_simple()->set_interval_s(kSixteenTicks_s);
  tune();
  identification::Evidence clock;
  clock.set_kilo_ticks_per_message(4800 / sent);
  add({"clock per robot",
       fmt::format("a message every 16 kilo_ticks (contention {:.2f})", radio.simple().contention()),
       {"time"},
       fmt::format("robots send {:.1f} in 4800 of their kilo_ticks, at most 301: one in {:.2f}", sent, 4800 / sent),
       clock,
       {}},
      alike(radio));
  proto::Radio disc;
  disc.set_model(proto::Radio::DISC);
  disc.set_range_mm(model_.range_mm);
  const Evidence hidden = hidden_terminal_evidence(train_);
  add({"packet timing",
       "packets of 4.371 ms, carrier sense from the start pulse, collisions where two overlap; nothing is tuned",
       {"neighbours"},
       text_of(hidden),
       entry_of(hidden),
       {}},
      alike(disc));
}

void RadioStudy::add_links() {
  const auto heard_in_some_run = [&] {
    double partly = 0, far = 0;
    for (const GridSet& set : train_) {
      const Eigen::MatrixXd on = on_share(set);
      for (int i = 0; i < set.robots(); ++i) {
        for (int j = 0; j < set.robots(); ++j) {
          const double d = set.distance_mm(i, j);
          if (d < kFar_mm || d > kNeverHeard_mm || on(i, j) < 0) continue;
          far += 1;
          partly += on(i, j) > 0.02;
        }
      }
    }
    return partly / far;
  };
  identification::Evidence heard;
  heard.set_heard_in_some_run(heard_in_some_run());
  add({"signal strength",
       fmt::format("0.139 dB/mm, heard up to {:.1f} mm, and noise from run to run", model_.range_mm),
       {"neighbours"},
       fmt::format("no distance divides the links: of those at 125..200 mm {:.0f} % are heard in some run",
                   100 * heard.heard_in_some_run()),
       heard,
       {}},
      fitted(model_));

  // Evidence in the residuals for the next effect, then the model with it.
  const auto step = [&](const char* name, auto evidence_of, Terms terms, auto words,
                        std::vector<std::string> covariates) {
    const Evidence evidence = evidence_of(train_, model_);
    model_ = fit_links(train_, terms);
    add({name, words(), std::move(covariates), text_of(evidence), entry_of(evidence), {}}, fitted(model_));
  };
  step("bearing", bearing_evidence, Terms::kPattern,
       [&] { return std::string("common transmit pattern over the bearing, 8 harmonics"); }, {"heading"});
  step("placement", placement_evidence, Terms::kPlacement,
       [&] { return fmt::format("a pattern per placement, sd {:.2f} dB", model_.laying_sd_db); }, {"heading"});
  step("bodies in between", body_evidence, Terms::kBodies,
       [&] { return fmt::format("{:.2f} dB for each", model_.body_loss_db); }, {"neighbours"});
  step("robots", robot_evidence, Terms::kRobots,
       [&] {
         return fmt::format("power and sensitivity of each robot, sd {:.2f} and {:.2f} dB", model_.power_sd_db,
                            model_.sensitivity_sd_db);
       },
       {"robot"});
  step("robots' bearings", robot_bearing_evidence, Terms::kBearings,
       [&] {
         return fmt::format("each robot's own dependence on the bearing, sd {:.2f} and {:.2f} dB",
                            model_.power_bearing_sd_db, model_.sensitivity_bearing_sd_db);
       },
       {"robot", "heading"});
  step("pairs", pair_evidence, Terms::kPairs,
       [&] {
         return fmt::format("per pair, sd {:.2f} dB, and per direction, {:.2f} dB", model_.pair_sd_db,
                            model_.link_sd_db);
       },
       {"robot", "neighbours"});
}

/// Loss of single packets: from the number of links with partial reception.
void RadioStudy::add_packets() {
  const auto partial = [&](double sd_db) {
    timing_.packet_sd_db = sd_db;
    const Radios radios = fitted(model_);
    double sum = 0;
    for (std::size_t q = 0; q < train_.size(); ++q)
      sum += statistics(simulate(train_[q], radios[q], work_.runs / 2, kFirstSeed)).partial;
    return sum / static_cast<double>(train_.size());
  };
  double measured = 0;
  for (const GridSet& set : train_) measured += statistics(set).partial / static_cast<double>(train_.size());
  const double before = partial(timing_.packet_sd_db);
  double best = 1, chosen = 0;
  for (const double sd_db : {0.0, 0.02, 0.04, 0.06, 0.08, 0.1, 0.15, 0.2}) {
    const double error = std::abs(partial(sd_db) - measured);
    if (error >= best) continue;
    best = error;
    chosen = sd_db;
  }
  timing_.packet_sd_db = chosen;
  identification::Evidence partly;
  partly.set_measured(measured);
  partly.set_before(before);
  add({"packet noise",
       fmt::format("noise from packet to packet, sd {:.2f} dB", chosen),
       {"time"},
       fmt::format("of (link, run) of 125..200 mm {:.3f} are heard in part; simulated with 0.15 dB {:.3f}, with "
                   "this {:.3f}",
                   measured, before, partial(chosen)),
       partly,
       {}},
      fitted(model_));
}

/// A robot with a fast clock meets ongoing transmissions more often and waits: its number of messages determines
/// its rate.
void RadioStudy::fit_oscillators(int rounds) {
  // One message in 300 corresponds to 1/300 of the rate under saturation, less otherwise. Steps below 1 converge.
  constexpr double kStep = 0.7 / 300;
  Eigen::VectorXd& rate = timing_.oscillator;
  for (int round = 0; round < rounds; ++round) {
    const Radios radios = fitted(model_);
    Eigen::VectorXd excess = Eigen::VectorXd::Zero(rate.size());
    double runs = 0;
    for (std::size_t q = 0; q < train_.size(); ++q) {
      const auto weight = static_cast<double>(train_[q].runs.size());
      const std::uint64_t seed = kFirstSeed + 100 * static_cast<std::uint64_t>(round + 1);
      excess += weight * (mean_sent(simulate(train_[q], radios[q], work_.runs / 2, seed)) - mean_sent(train_[q]));
      runs += weight;
    }
    rate += kStep / runs * excess;
    rate.array() -= rate.mean();
  }
}

/// Clock rates vary between runs: the maximum-likelihood spread.
void RadioStudy::fit_wander() {
  double best = -1e9, chosen = 0;
  for (const double sd : {0.0, 0.0005, 0.001, 0.002, 0.003, 0.004, 0.005}) {
    timing_.oscillator_sd = sd;
    const Radios radios = fitted(model_);
    double likelihood = 0;
    for (std::size_t q = 0; q < train_.size(); ++q)
      likelihood += log_likelihood(train_[q], simulate(train_[q], radios[q], work_.runs, kFirstSeed + 1000));
    if (likelihood <= best) continue;
    best = likelihood;
    chosen = sd;
  }
  timing_.oscillator_sd = chosen;
}

void RadioStudy::add_oscillators() {
  const Evidence own = oscillator_evidence(train_);
  timing_.oscillator = Eigen::VectorXd::Zero(train_.front().robots());
  timing_.oscillator_sd = 0.001;
  fit_oscillators(6);
  fit_wander();
  fit_oscillators(3);
  const double own_sd =
      std::sqrt(timing_.oscillator.squaredNorm() / static_cast<double>(timing_.oscillator.size()));
  add({"oscillators",
       fmt::format("the rate of each robot's clock, sd {:.2f} %, and from run to run {:.2f} %", 100 * own_sd,
                   100 * timing_.oscillator_sd),
       {"robot", "time"},
       text_of(own),
       entry_of(own),
       {}},
      fitted(model_));
}

/// Carrier sense at levels below reception: robots wait for senders that they cannot receive.
void RadioStudy::add_carrier_sense() {
  const Evidence notice = hidden_sender_evidence(train_);
  double best = 1e9, chosen = 0;
  for (const double notice_db : {0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0}) {
    timing_.notice_db = notice_db;
    const Radios radios = fitted(model_);
    double error = 0;
    for (std::size_t q = 0; q < train_.size(); ++q) {
      const double lost = 1 - statistics(train_[q]).near;
      const double simulated = 1 - statistics(simulate(train_[q], radios[q], work_.runs, kFirstSeed)).near;
      error += (simulated - lost) * (simulated - lost);
    }
    if (error >= best) continue;
    best = error;
    chosen = notice_db;
  }
  timing_.notice_db = chosen;
  fit_oscillators(3);
  add({"carrier sense below reception",
       fmt::format("carrier sense detects signals down to {:.2f} dB below the reception level", chosen),
       {"neighbours"},
       text_of(notice),
       entry_of(notice),
       {}},
      fitted(model_));
}

/// With random clocks: own rates and variation between runs.
LinkModel::Timing RadioStudy::drawn() const {
  LinkModel::Timing timing = timing_;
  const double own = timing.oscillator.squaredNorm() / static_cast<double>(timing.oscillator.size());
  timing.oscillator_sd = std::sqrt(own + timing.oscillator_sd * timing.oscillator_sd);
  timing.oscillator.resize(0);
  return timing;
}

template <class RadioOf>
std::vector<std::vector<double>> RadioStudy::reception_of_swarms(std::size_t q, RadioOf&& radio_of) const {
  std::vector<std::vector<double>> drawn(statistics(test_[q]).classes.size());
  for (int k = 0; k < work_.swarms; ++k) {
    GridSet one = train_[q];
    one.runs = {simulate(train_[q], radio_of(k), kFirstSwarm + static_cast<std::uint64_t>(k))};
    const Statistics s = statistics(one);
    for (std::size_t c = 0; c < drawn.size(); ++c) drawn[c].push_back(s.classes[c].reception);
  }
  return drawn;
}

/// Predictive check with new robots: is the measured set typical of the population?
void RadioStudy::draw_population() {
  for (std::size_t q = 0; q < train_.size(); ++q) {
    const proto::Radio radio = model_.population(model_.swarms[q], drawn());
    const Statistics real = statistics(test_[q]);
    std::vector<std::vector<double>> drawn =
        reception_of_swarms(q, [&](int) -> const proto::Radio& { return radio; });
    for (std::size_t c = 0; c < drawn.size(); ++c) {
      const auto at = [&](double share) { return stats::nearest_quantile(drawn[c], share); };
      const DisplacementClass& is = real.classes[c];
      identification::PopulationClass& row = population_.emplace_back();
      row.set_set(train_[q].name);
      row.set_rows(is.rows);
      row.set_columns(is.columns);
      row.set_distance_mm(is.distance_mm);
      row.set_measured(is.reception);
      row.set_low(at(0.025));
      row.set_median(at(0.5));
      row.set_high(at(0.975));
      row.set_inside(is.reception >= row.low() - 1e-9 && is.reception <= row.high() + 1e-9);
    }
  }
}

const LinkModel::Swarm& RadioStudy::steadiest() const {
  // Undisturbed placements vary least between runs.
  return *std::min_element(model_.swarms.begin(), model_.swarms.end(),
                           [](const auto& a, const auto& b) { return a.run_sd_db < b.run_sd_db; });
}

void write_text(const std::filesystem::path& file, const std::string& text) {
  std::ofstream out(file);
  out << text;
  if (!out.flush()) throw RunError(file.string() + ": cannot be written");
}

proto::Model RadioStudy::write_models() const {
  const auto write = [&](const proto::Radio& radio, const std::string& name, const std::string& about) {
    proto::Model model;
    proto::Propagation& propagation = *model.mutable_propagation() = radio.propagation();
    propagation.set_range_mm(radio.range_mm());
    propagation.set_oscillator_sd(radio.oscillator_sd());
    std::string text;
    google::protobuf::TextFormat::PrintToString(model, &text);
    write_text(out_ / name, "# " + about + "\n" + text);
    return model;
  };
  for (std::size_t q = 0; q < train_.size(); ++q) {
    write(model_.radio(model_.swarms[q], timing_), "model-" + train_[q].name + ".txtpb",
          "The same with the robots and pairs of " + train_[q].name + ".");
  }
  return write(model_.population(steadiest(), drawn()), "model.txtpb",
               "Range, pattern and variances, fitted to all sets; robots and pairs are random.");
}

identification::RadioErrors entry_of(const Errors& e) {
  identification::RadioErrors out;
  out.set_sent(e.simulated.sent);
  out.set_sent_error(e.sent);
  out.set_near_worst(e.near_worst);
  out.set_far_worst(e.far_worst);
  out.set_silent_error(e.silent);
  out.set_sender_spread_error(e.sender_spread);
  out.set_run_spread_error(e.run_spread);
  out.set_log_likelihood(e.log_likelihood);
  out.set_deficit(e.deficit);
  return out;
}

identification::RadioModel entry_of(const LinkModel& model, const LinkModel::Timing& timing) {
  identification::RadioModel out;
  out.set_range_mm(model.range_mm);
  identify::assign(out.mutable_pattern_db(), model.pattern_db);
  out.set_body_loss_db(model.body_loss_db);
  out.set_power_sd_db(model.power_sd_db);
  out.set_sensitivity_sd_db(model.sensitivity_sd_db);
  out.set_power_bearing_sd_db(model.power_bearing_sd_db);
  out.set_sensitivity_bearing_sd_db(model.sensitivity_bearing_sd_db);
  out.set_pair_sd_db(model.pair_sd_db);
  out.set_link_sd_db(model.link_sd_db);
  out.set_laying_sd_db(model.laying_sd_db);
  out.set_packet_sd_db(timing.packet_sd_db);
  out.set_notice_db(timing.notice_db);
  out.set_oscillator_sd(timing.oscillator_sd);
  for (const double rate : timing.oscillator) out.add_oscillator(rate);
  return out;
}

identification::RadioFit RadioStudy::result() const {
  identification::RadioFit out;
  for (const Step& step : steps_) {
    identification::RadioStep& effect = *out.add_effects();
    effect.set_name(step.name);
    identify::assign(effect.mutable_covariates(), step.covariates);
    effect.set_acts_on("radio");
    *effect.mutable_evidence() = step.figures;
    effect.mutable_parameters()->set_added(step.added);
    for (std::size_t q = 0; q < step.errors.size(); ++q)
      (*effect.mutable_errors())[train_[q].name] = entry_of(step.errors[q]);
  }
  for (std::size_t q = 0; q < train_.size(); ++q) {
    (*out.mutable_fitted_runs_themselves())[train_[q].name] = entry_of(compare(test_[q], train_[q], train_[q]));
    (*out.mutable_measured_sent())[test_[q].name] = statistics(test_[q]).sent;
  }
  *out.mutable_shared() = entry_of(model_, timing_);
  for (const identification::Estimate& number : numbers_of(model_, train_, os::cores()))
    *out.mutable_shared()->add_numbers() = number;
  identification::RadioSets& sets = *out.mutable_of_each_set();
  sets.set_correlation_of_power(same_robots(model_, true));
  sets.set_correlation_of_sensitivity(same_robots(model_, false));
  for (const LinkModel::Swarm& swarm : model_.swarms) (*sets.mutable_run_sd_db())[swarm.set] = swarm.run_sd_db;
  for (const identification::PopulationClass& row : population_) *out.add_population() = row;
  return out;
}

std::string cells_of(const identification::RadioErrors& e) {
  return fmt::format("{:+.1f} | {:.3f} | {:.3f} | {:+.3f} | {:+.3f} | {:+.3f} | {:.2f} | {:.2f} |\n",
                     e.sent_error(), e.near_worst(), e.far_worst(), e.silent_error(), e.sender_spread_error(),
                     e.run_spread_error(), e.log_likelihood(), e.deficit());
}

void RadioStudy::write_tables(const identification::RadioFit& fit) const {
  std::string table =
      "| effect | evidence | added | set | sent | near | far | silent | senders | runs | likelihood | deficit "
      "|\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|\n";
  for (const Step& step : steps_) {
    for (std::size_t q = 0; q < step.errors.size(); ++q)
      table += fmt::format("| {} | {} | {} | {} | {}", q == 0 ? step.name : "", q == 0 ? step.evidence : "",
                           q == 0 ? step.added : "", train_[q].name, cells_of(entry_of(step.errors[q])));
  }
  for (std::size_t q = 0; q < train_.size(); ++q)
    table += fmt::format("| {} | | | {} | {}", q == 0 ? "training runs as prediction" : "", train_[q].name,
                         cells_of(fit.fitted_runs_themselves().at(train_[q].name)));
  table +=
      "\n| set | rows, columns | mm | measured | fitted | population, 95 % of swarms "
      "|\n|---|---|---|---|---|---|\n";
  for (const identification::PopulationClass& row : population_) {
    if (row.distance_mm() > kNeverHeard_mm) continue;
    double fitted = 0;
    for (std::size_t q = 0; q < train_.size(); ++q) {
      if (train_[q].name != row.set()) continue;
      for (const DisplacementClass& c : steps_.back().errors[q].simulated.classes) {
        if (c.rows == row.rows() && c.columns == row.columns()) fitted = c.reception;
      }
    }
    table += fmt::format("| {} | {}, {} | {:.0f} | {:.3f} | {:.3f} | {:.2f}..{:.2f}{} |\n", row.set(), row.rows(),
                         row.columns(), row.distance_mm(), row.measured(), fitted, row.low(), row.high(),
                         row.inside() ? "" : ", outside");
  }
  write_text(out_ / "effects.md", table);
}

/// The measured sets beside swarms that stand as those of model.txtpb do, and beside swarms of other placements: the common pattern
/// plus one that is drawn for each swarm. Classes of one distance together.
void RadioStudy::write_placements() const {
  const proto::Radio population = model_.population(steadiest(), drawn());
  const auto with_pattern = [&](const std::vector<double>& pattern_db) {
    LinkModel::Swarm swarm = steadiest();
    swarm.pattern_db = pattern_db;
    return model_.population(swarm, drawn());
  };
  const auto drawn_placement = [&](int k) {
    const Random random(kFirstSwarm);
    std::vector<double> pattern_db = model_.pattern_db;
    for (std::size_t n = 0; n < pattern_db.size(); ++n)
      pattern_db[n] +=
          model_.laying_sd_db / static_cast<double>(harmonic_of(n)) *
          random.normal(Stream::kLink, static_cast<std::uint32_t>(k), Tick{0}, static_cast<std::uint32_t>(n));
    return with_pattern(pattern_db);
  };
  std::string table =
      "| set | mm | measured | swarms placed as model.txtpb | 95 % | common pattern | 95 % | drawn placements | 95 "
      "% |\n"
      "|---|---|---|---|---|---|---|---|---|\n";
  for (std::size_t q = 0; q < train_.size(); ++q) {
    const std::vector<DisplacementClass> real = statistics(test_[q]).classes;
    const std::vector<std::vector<double>> as[] = {
        reception_of_swarms(q, [&](int) -> const proto::Radio& { return population; }),
        reception_of_swarms(q, [&](int) { return with_pattern(model_.pattern_db); }),
        reception_of_swarms(q, drawn_placement)};
    for (std::size_t c = 0, end = 0; c < real.size() && real[c].distance_mm <= kNeverHeard_mm; c = end) {
      while (end < real.size() && real[end].distance_mm - real[c].distance_mm < 1e-6) ++end;
      const auto mean_of = [&](auto&& value) {
        double sum = 0;
        for (std::size_t k = c; k < end; ++k) sum += value(k);
        return sum / static_cast<double>(end - c);
      };
      const double measured = mean_of([&](std::size_t k) { return real[k].reception; });
      table += fmt::format("| {} | {:.0f} | {:.3f} |", train_[q].name, real[c].distance_mm, measured);
      for (const auto& classes : as) {
        std::vector<double> swarms;
        stats::Moments moments;
        for (std::size_t s = 0; s < classes[c].size(); ++s) {
          swarms.push_back(mean_of([&](std::size_t k) { return classes[k][s]; }));
          moments.add(swarms.back());
        }
        const double low = stats::nearest_quantile(swarms, 0.025), high = stats::nearest_quantile(swarms, 0.975);
        const bool inside = measured >= low - 1e-9 && measured <= high + 1e-9;
        table += fmt::format(" {:.3f} | {:.2f}..{:.2f}{} |", moments.mean(), low, high, inside ? "" : ", outside");
      }
      table += "\n";
    }
  }
  write_text(out_ / "placements.md", table);
}

void RadioStudy::write_figures() const {
  for (std::size_t q = 0; q < train_.size(); ++q) {
    Plot plot;
    plot.title = fmt::format("Reception over distance, {}", train_[q].name);
    plot.subtitle = fmt::format("{} held-out runs; {} simulated runs", test_[q].runs.size(), work_.runs);
    plot.x_name = "distance";
    plot.x_unit = "mm";
    plot.y_name = "reception share";
    const auto series = [&](const std::string& name, const Statistics& s) {
      PlotSeries& line = plot.series.emplace_back();
      line.name = name;
      line.line = false;
      for (const DisplacementClass& c : s.classes) {
        if (c.distance_mm > kNeverHeard_mm) continue;
        line.x.push_back(c.distance_mm);
        line.y.push_back(c.reception);
      }
    };
    series("measured", statistics(test_[q]));
    series(steps_.front().name, steps_.front().errors[q].simulated);
    series("all effects", steps_.back().errors[q].simulated);
    write_plot(plot, out_ / ("reception-" + train_[q].name + ".svg"));
  }
  Plot plot;
  plot.title = "Gain of each effect";
  plot.subtitle = "log-likelihood of held-out runs, below that of the training runs' means";
  plot.x_name = "effect";
  plot.y_name = "deficit per pair and run";
  plot.y_unit = "nat";
  plot.y_logarithmic = true;
  for (const Step& step : steps_) plot.x_categories.push_back(step.name);
  for (std::size_t q = 0; q < train_.size(); ++q) {
    PlotSeries& line = plot.series.emplace_back();
    line.name = train_[q].name;
    for (std::size_t n = 0; n < steps_.size(); ++n) {
      line.x.push_back(static_cast<double>(n));
      line.y.push_back(std::max(steps_[n].errors[q].deficit, 1e-3));
    }
  }
  write_plot(plot, out_ / "effects.svg");
}

void RadioStudy::search() {
  add_links();
  add_packets();
  add_oscillators();
  add_carrier_sense();
}

identify::Identified RadioStudy::report() {
  std::error_code error;
  std::filesystem::create_directories(out_, error);
  if (error) throw UserError(fmt::format("{}: cannot be made: {}", out_.string(), error.message()));
  const identification::RadioFit fit = result();
  proto::Model model = write_models();
  write_text(out_ / "result.json", identify::json_of(fit).dump(2) + "\n");
  write_tables(fit);
  if (work_.placements) write_placements();
  write_figures();
  return identified_of(fit, std::move(model));
}

}  // namespace

bool has_radio_runs(const std::filesystem::path& directory) {
  std::error_code error;
  const std::filesystem::directory_iterator files(directory, error);
  return std::any_of(begin(files), end(files), [](const std::filesystem::directory_entry& entry) {
    const std::string name = entry.path().filename().string();
    return name.starts_with("comm_tau") && name.find("_run") != std::string::npos && name.ends_with(".dat");
  });
}

std::unique_ptr<identify::Study> radio_study(const RadioData& data, const RadioWork& work,
                                             std::filesystem::path out, const identify::Options& options) {
  return std::make_unique<RadioStudy>(data, work, std::move(out), options);
}

}  // namespace kilotwin::radio_fit
