#include "clients/identify/design/question.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <optional>
#include <set>

#include "clients/identify/design/tracked_plan.hpp"
#include "core/base/error.hpp"

namespace kilotwin::identify {
namespace {

using proto::Effect, proto::Function;

/// Standard deviations where the result has none: the priors of the fit, and an effect that may be half or double.
constexpr double kStraightSd_mm_s = 1, kTurnSd_mm_s = 2, kWheelBaseSd_mm = 2, kAmplitudeSd = 0.5;
constexpr double kTrendSd = 0.5;

Eigen::Index add(DesignQuestion& question, DesignColumn column) {
  question.columns.push_back(std::move(column));
  return static_cast<Eigen::Index>(question.columns.size()) - 1;
}

/// The columns of the base model, which all models share.
std::vector<Eigen::Index> add_base(DesignQuestion& question, const identification::Base& sd) {
  const auto known = [](double value, double otherwise) { return value > 0 ? value : otherwise; };
  // Step of the derivatives, mm/s and mm; with a larger one, tracks depart from the linear range.
  constexpr double kStep = 0.02;
  return {add(question, {"straight speed, mm/s", known(sd.straight_speed_mm_s(), kStraightSd_mm_s), kStep,
                         [](proto::Model& m, double by) {
                           m.mutable_motion()->set_straight_speed_mm_s(m.motion().straight_speed_mm_s() + by);
                         }}),
          add(question, {"turn speed, mm/s", known(sd.turn_speed_mm_s(), kTurnSd_mm_s), kStep,
                         [](proto::Model& m, double by) {
                           m.mutable_motion()->set_turn_speed_mm_s(m.motion().turn_speed_mm_s() + by);
                         }}),
          add(question,
              {"wheel base, mm", known(sd.wheel_base_mm(), kWheelBaseSd_mm), kStep, [](proto::Model& m, double by) {
                 m.mutable_motion()->set_wheel_base_mm(m.motion().wheel_base_mm() + by);
               }})};
}

/// Step of the derivatives by amplitudes. Tracks then differ by little, also at the end of a long recording.
constexpr double kAmplitudeStep = 0.01;

/// Adds effects with a small amplitude: beside the same effects of the present model this changes theirs.
std::function<void(proto::Model&, double)> more_of(std::vector<Effect> effects) {
  return [effects = std::move(effects)](proto::Model& m, double by) {
    for (std::size_t e = 0; e < effects.size(); ++e) {
      Effect& added = *m.add_effect();
      added = effects[e];
      added.set_name("added-" + std::to_string(e));
      added.add_function()->set_constant(by);
    }
  };
}

/// The range over which a trend of a covariate is normalised; none: the covariate has no order.
std::optional<std::pair<double, double>> range_of(Function::Covariate c, double duration_s, double reach_mm) {
  // Ranges of a trend over times since commands and over distances; wider ones make its slope smaller.
  constexpr double kCommand_s = 20, kNear_mm = 150;
  switch (c) {
    case Function::TIME:
    case Function::MOTOR_TIME:
    case Function::LEFT_MOTOR_TIME:
    case Function::RIGHT_MOTOR_TIME:
    case Function::DRIVEN_TIME:
    case Function::SINCE_REST: return {{0, duration_s}};
    case Function::MOTOR_TIME_DIFFERENCE: return {{-duration_s / 2, duration_s / 2}};
    case Function::MOTOR_TIME_SUM: return {{0, 2 * duration_s}};
    case Function::TIME_SINCE_COMMAND:
    case Function::PREVIOUS_LASTED: return {{0, kCommand_s}};
    case Function::X:
    case Function::Y: return {{-reach_mm, reach_mm}};
    case Function::RADIUS: return {{0, reach_mm}};
    case Function::NEAREST: return {{0, kNear_mm}};
    default: return std::nullopt;
  }
}

/// Effects times u, which rises from -1 to 1 over the range of the covariate of one of their functions.
std::vector<Effect> with_trend(std::vector<Effect> effects, Function::Covariate covariate, double low,
                               double high) {
  std::vector<Effect> out;
  for (Effect& effect : effects) {
    const auto at = std::find_if(effect.function().begin(), effect.function().end(),
                                 [&](const Function& f) { return f.of() == covariate; });
    if (at == effect.function().end()) continue;
    Function trend = *at;
    trend.clear_shape();
    trend.clear_and_of();
    trend.mutable_linear()->set_slope(2 / (high - low));
    trend.mutable_linear()->set_at_zero(-(high + low) / (high - low));
    *effect.add_function() = trend;
    out.push_back(std::move(effect));
  }
  return out;
}

/// An effect without its name: two models may number the same record differently.
std::string content_of(const Effect& effect) {
  Effect unnamed = effect;
  unnamed.clear_name();
  unnamed.clear_sum();
  return unnamed.SerializeAsString();
}

/// Adds the columns of the effects that distinguish a model.
void add_own(DesignQuestion& question, Candidate& candidate, const std::vector<Effect>& own, double duration_s,
             double reach_mm) {
  if (own.empty()) return;
  candidate.amplitude = {
      add(question, {"amplitude, " + candidate.name, kAmplitudeSd, kAmplitudeStep, more_of(own)})};
  candidate.fitted.push_back(candidate.amplitude.front());
  std::set<Function::Covariate> covariates;
  for (const Effect& effect : own)
    for (const Function& function : effect.function()) covariates.insert(function.of());
  for (const Function::Covariate covariate : covariates) {
    const auto range = range_of(covariate, duration_s, reach_mm);
    if (!range) continue;
    candidate.fitted.push_back(add(
        question, {fmt::format("trend over {}, {}", Function::Covariate_Name(covariate), candidate.name), kTrendSd,
                   kAmplitudeStep, more_of(with_trend(own, covariate, range->first, range->second))}));
  }
}  // NOLINT(clang-analyzer-cplusplus.NewDeleteLeaks): the analyzer does not see that std::function deletes its functor

/// The effect of the result whose records these are: the longest name that the record's begins with.
const identification::Effect* effect_named(const identification::Result& result, const std::string& record) {
  const identification::Effect* found = nullptr;
  for (const identification::Effect& effect : result.effects())
    if (record.starts_with(effect.name()) && (found == nullptr || effect.name().size() > found->name().size()))
      found = &effect;
  return found;
}

/// The sum of squares that is left of a difference when a model's parameters are fitted: d'd - d'J (J'J + precision)^-1 J'd.
double left_after_fit(const DesignQuestion& question, const Eigen::MatrixXd& products,
                      const Eigen::VectorXd& difference, const std::vector<Eigen::Index>& fitted) {
  Eigen::MatrixXd information = products(fitted, fitted);
  for (std::size_t i = 0; i < fitted.size(); ++i) {
    const double sd = question.columns[static_cast<std::size_t>(fitted[i])].sd;
    information(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(i)) += 1 / (sd * sd);
  }
  const Eigen::VectorXd with_all = products * difference;
  const Eigen::VectorXd score = with_all(fitted);
  return difference.dot(with_all) - score.dot(information.llt().solve(score));
}

Eigen::VectorXd precision_of(const DesignQuestion& question) {
  Eigen::VectorXd out(static_cast<Eigen::Index>(question.columns.size()));
  for (Eigen::Index i = 0; i < out.size(); ++i) {
    const double sd = question.columns[static_cast<std::size_t>(i)].sd;
    out[i] = 1 / (sd * sd);
  }
  return out;
}

/// The arena fields of all models: a model's own effects refer to its own.
void add_fields(proto::Model& present, const proto::Model& model) {
  for (const proto::ArenaField& field : model.field()) {
    const bool known = std::any_of(present.field().begin(), present.field().end(),
                                   [&](const proto::ArenaField& f) { return f.name() == field.name(); });
    if (!known) *present.add_field() = field;
  }
}

}  // namespace

DesignQuestion question_of_parameters(const proto::Model& model, const identification::Result& result) {
  DesignQuestion question{without_tracker_noise(model), {}, {{"the present model", {}, {}}}};
  question.models.front().fitted = add_base(question, result.base_sd());
  std::map<std::string, std::vector<Effect>> records;
  for (const Effect& record : question.present.effect())
    if (const auto* effect = effect_named(result, record.name())) records[effect->name()].push_back(record);
  for (auto& [name, effects] : records) {
    // An effect of evidence E stands sqrt(2 E) standard deviations above none.
    const double evidence = effect_named(result, name)->evidence().log_likelihood_gain();
    const double sd = evidence > 0 ? std::clamp(1 / std::sqrt(2 * evidence), 0.01, kAmplitudeSd) : kAmplitudeSd;
    question.models.front().fitted.push_back(
        add(question, {"relative amplitude of " + name, sd, kAmplitudeStep, more_of(std::move(effects))}));
  }
  return question;
}  // NOLINT(clang-analyzer-cplusplus.NewDeleteLeaks): as above

DesignQuestion question_of_models(const std::vector<std::pair<std::string, proto::Model>>& models,
                                  const identification::Result& result, double duration_s, double reach_mm) {
  DesignQuestion question{without_tracker_noise(models.front().second), {}, {}};
  const std::vector<Eigen::Index> base = add_base(question, result.base_sd());
  std::map<std::string, std::size_t> holders;
  std::vector<std::set<std::string>> contents;
  for (const auto& [name, model] : models) {
    std::set<std::string>& own = contents.emplace_back();
    const proto::Model quiet = without_tracker_noise(model);
    for (const Effect& effect : quiet.effect()) own.insert(content_of(effect));
    for (const std::string& content : own) ++holders[content];
    if (const auto same = std::find(contents.begin(), std::prev(contents.end()), own);
        same != std::prev(contents.end()))
      throw UserError(fmt::format("{}: has the same effects as {}; give models with different effects", name,
                                  models[static_cast<std::size_t>(same - contents.begin())].first));
  }
  for (const auto& [name, model] : models) {
    add_fields(question.present, model);
    std::vector<Effect> own;
    const proto::Model quiet = without_tracker_noise(model);
    for (const Effect& effect : quiet.effect())
      if (holders[content_of(effect)] < models.size()) own.push_back(effect);
    Candidate candidate{name, base, {}};
    add_own(question, candidate, own, duration_s, reach_mm);
    question.models.push_back(std::move(candidate));
  }
  return question;
}

double information_nat(const DesignQuestion& question, const Eigen::MatrixXd& products) {
  if (question.of_parameters()) {
    const Eigen::VectorXd precision = precision_of(question);
    Eigen::MatrixXd with_prior = products;
    with_prior.diagonal() += precision;
    return Eigen::LLT<Eigen::MatrixXd>(with_prior).matrixLLT().diagonal().array().log().sum() -
           0.5 * precision.array().log().sum();
  }
  double least = std::numeric_limits<double>::infinity();
  const Candidate& present = question.models.front();
  for (std::size_t m = 1; m < question.models.size(); ++m) {
    const Candidate& rival = question.models[m];
    Eigen::VectorXd difference = Eigen::VectorXd::Zero(products.rows());
    for (const Eigen::Index a : rival.amplitude) difference[a] += 1;
    for (const Eigen::Index a : present.amplitude) difference[a] -= 1;
    // Either model may be true; then the other one is fitted. A model with the other's effects and more can always imitate it.
    if (!rival.amplitude.empty())
      least = std::min(least, 0.5 * left_after_fit(question, products, difference, present.fitted));
    if (!present.amplitude.empty())
      least = std::min(least, 0.5 * left_after_fit(question, products, difference, rival.fitted));
  }
  return least;
}

std::vector<double> sds_after(const DesignQuestion& question, const Eigen::MatrixXd& products) {
  Eigen::MatrixXd information = products;
  information.diagonal() += precision_of(question);
  const Eigen::MatrixXd covariance =
      information.llt().solve(Eigen::MatrixXd::Identity(products.rows(), products.cols()));
  std::vector<double> out;
  for (Eigen::Index i = 0; i < products.rows(); ++i) out.push_back(std::sqrt(covariance(i, i)));
  return out;
}

}  // namespace kilotwin::identify
