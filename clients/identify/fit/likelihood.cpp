#include "clients/identify/fit/likelihood.hpp"

#include <Eigen/Cholesky>
#include <limits>
#include <numeric>

#include "clients/identify/fit/fitter.hpp"
#include "core/os/worker_pool.hpp"

namespace kilotwin::identify {

LogLikelihood likelihood_of(const MotionModel& model, const TrackView& view, bool include_contacts) {
  RobotBias bias = model.bias_of(view.track->robot);
  bias.covariance.setZero();
  TrackFilter filter(model, bias, view.track->robot, view.number);
  LogLikelihood likelihood;
  likelihood.include_contacts = include_contacts;
  run_filter(filter, view, view.track->samples.size(), likelihood);
  return likelihood;
}

double Fitter::log_likelihood_with_contacts(const MotionModel& model,
                                            const std::vector<const TrackView*>& tracks) const {
  std::vector<double> sums(tracks.size());
  os::in_parallel(tracks.size(), threads_,
                  [&](std::size_t i) { sums[i] = likelihood_of(model, *tracks[i], true).sum; });
  return std::accumulate(sums.begin(), sums.end(), 0.0);
}

double Fitter::log_likelihood(const FitState& state) const {
  const std::vector<TrackView>& views = state.tracks.views();
  std::vector<double> sums(views.size());
  os::in_parallel(views.size(), threads_, [&](std::size_t i) {
    if (views[i].track->held_out) return;
    sums[i] = likelihood_of(state.model, views[i]).sum;
  });
  return std::accumulate(sums.begin(), sums.end(), 0.0);
}

double Fitter::log_likelihood_of_all(const FitState& state) const {
  return log_likelihood_with_contacts(state.model,
                                      state.tracks.some_tracks(std::numeric_limits<std::size_t>::max()));
}

double Fitter::log_evidence(const FitState& state) const {
  const MotionModel& model = state.model;
  double value = log_likelihood(state);
  if (model.terms.empty()) return value;
  const std::vector<Unit> units = linearise(model, state.tracks.units(), blocks_of(model), {100, threads_});
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(units[0].information.rows(), units[0].information.cols());
  for (const Unit& unit : units) information += unit.information;
  Eigen::VectorXd unused = Eigen::VectorXd::Zero(information.rows());
  add_base_prior(model, information, unused);
  const Eigen::Index n = information.rows() - kBaseColumns;
  Eigen::VectorXd sd(n);
  Eigen::Index first = 0;
  for (const Term& term : model.terms) {
    sd.segment(first, term.precision.size()) = term.precision.cwiseInverse().cwiseSqrt();
    value -= 0.5 * term.precision.dot(term.coefficients.cwiseAbs2());
    first += term.precision.size();
  }
  // Marginal over the base parameters: their Schur complement.
  const Eigen::MatrixXd cross = information.topRightCorner(kBaseColumns, n);
  const Eigen::MatrixXd by = information.topLeftCorner<kBaseColumns, kBaseColumns>().ldlt().solve(cross);
  Eigen::MatrixXd posterior = information.bottomRightCorner(n, n) - cross.transpose() * by;
  posterior = (sd.asDiagonal() * posterior * sd.asDiagonal()).eval();
  posterior.diagonal().array() += 1;
  return value - Eigen::LLT<Eigen::MatrixXd>(posterior).matrixLLT().diagonal().array().log().sum();
}

}  // namespace kilotwin::identify
