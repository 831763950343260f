#include "clients/identify/search/local_quadratic.hpp"

#include <Eigen/Cholesky>

#include "clients/identify/model/camera_scale.hpp"

namespace kilotwin::identify {

LocalQuadratic local_quadratic(const Fitter& fitter, const FitState& state, std::size_t term,
                               const std::vector<Block>& more, bool beside) {
  const MotionModel& model = state.model;
  std::vector<Block> blocks = blocks_of(model);
  blocks.insert(blocks.end(), more.begin(), more.end());
  LocalQuadratic out;
  out.units =
      linearise(model, state.tracks.units(), blocks, {100, fitter.threads(), beside ? -1 : static_cast<int>(term)});
  const Eigen::Index all = out.units.front().information.rows();
  out.information = Eigen::MatrixXd::Zero(all, all);
  out.score = Eigen::VectorXd::Zero(all);
  for (const Unit& unit : out.units) {
    out.information += unit.information;
    out.score += unit.score;
  }
  Eigen::MatrixXd base = Eigen::MatrixXd::Zero(all, all);
  fitter.add_base_prior(model, base, out.score);
  out.prior = base.diagonal();
  out.own = kBaseColumns;
  for (std::size_t t = 0; t < model.terms.size(); ++t) {
    const Term& own = model.terms[t];
    const Eigen::Index n = own.coefficients.size();
    if (t == term) {
      out.first = out.own;
      out.count = n;
    } else {
      out.prior.segment(out.own, n) = own.precision;
      out.score.segment(out.own, n) -= own.precision.cwiseProduct(own.coefficients);
    }
    out.own += n;
  }
  return out;
}

std::vector<Eigen::Index> LocalQuadratic::other_columns() const {
  std::vector<Eigen::Index> others;
  for (Eigen::Index i = 0; i < own; ++i)
    if (i < first || i >= first + count) others.push_back(i);
  return others;
}

std::vector<Eigen::Index> LocalQuadratic::added_columns() const {
  std::vector<Eigen::Index> columns;
  for (Eigen::Index i = own; i < information.rows(); ++i) columns.push_back(i);
  return columns;
}

std::vector<Eigen::Index> LocalQuadratic::term_columns() const {
  std::vector<Eigen::Index> columns;
  for (Eigen::Index i = first; i < first + count; ++i) columns.push_back(i);
  return columns;
}

Eigen::VectorXd LocalQuadratic::score_without(const Eigen::VectorXd& coefficients) const {
  return score + information.middleCols(first, count) * coefficients;
}

ReducedColumns reduced_columns(const LocalQuadratic& l, const Eigen::VectorXd& at_zero,
                               const std::vector<Eigen::Index>& columns) {
  const std::vector<Eigen::Index> others = l.other_columns();
  Eigen::MatrixXd own = l.information(others, others);
  own.diagonal() += l.prior(others);
  const Eigen::MatrixXd cross = l.information(others, columns);
  const Eigen::MatrixXd by = own.ldlt().solve(cross);
  return {l.information(columns, columns) - cross.transpose() * by,
          at_zero(columns) - by.transpose() * at_zero(others)};
}

void replace_blocks(MotionModel& model, std::size_t place, const LocalQuadratic& l,
                    const std::vector<Block>& blocks, const Eigen::VectorXd& at_zero,
                    const std::vector<Eigen::Index>& columns, const Eigen::VectorXd& sd) {
  Term& term = model.terms[place];
  std::vector<Eigen::Index> moved = l.other_columns();
  moved.insert(moved.end(), columns.begin(), columns.end());
  Eigen::MatrixXd own = l.information(moved, moved);
  Eigen::VectorXd precision = Eigen::VectorXd::Zero(l.information.rows());
  precision.head(l.own) = l.prior.head(l.own);
  precision(columns) = sd.array().square().inverse();
  own.diagonal() += precision(moved);
  const Eigen::VectorXd part = own.ldlt().solve(Eigen::VectorXd(at_zero(moved)));
  Eigen::VectorXd step = Eigen::VectorXd::Zero(l.information.rows());
  for (std::size_t i = 0; i < moved.size(); ++i) step[moved[i]] = part[static_cast<Eigen::Index>(i)];
  step.segment(l.first, l.count) = -term.coefficients;
  const MotionModel before = model;
  Fitter::apply(model, l.units, step);
  term.blocks = blocks;
  term.coefficients = step(columns);
  term.precision = precision(columns);
  if (model.walls.any() && (before.measures() || model.measures()))
    model.walls = carried(model.walls, before, model);
}

}  // namespace kilotwin::identify
