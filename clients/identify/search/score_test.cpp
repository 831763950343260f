#include "clients/identify/search/score_test.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "core/os/worker_pool.hpp"
#include "core/random/random.hpp"
#include "core/stats/distributions.hpp"

namespace kilotwin::identify {
namespace {

/// Folds of the held-out check, over units and over stretches of time. More leave more data in each fit, and cost time;
/// fewer lower the power.
constexpr std::size_t kFolds = 6;

/// Columns or rows of a matrix that one task computes. A constant, so that no result depends on the number of threads.
constexpr Eigen::Index kBlock = 128;

/// Calls task(first, count) for blocks of 0..size.
template <class Task> void in_blocks(Eigen::Index size, std::uint32_t threads, const Task& task) {
  os::in_parallel(static_cast<std::size_t>((size + kBlock - 1) / kBlock), threads, [&](std::size_t b) {
    const Eigen::Index first = static_cast<Eigen::Index>(b) * kBlock;
    task(first, std::min(kBlock, size - first));
  });
}

bool of_robots(const Hypothesis& h) {
  return std::find(h.covariates.begin(), h.covariates.end(), "robot") != h.covariates.end();
}

/// Sum of squared cluster scores about the mean of each unit. An effect of one robot makes its clusters alike;
/// that is signal, not noise. 0 if the units have too few clusters.
double within_units(const Eigen::MatrixXd& scores, const std::vector<std::size_t>& unit) {
  // Degrees of freedom; with fewer, the sum about the means is too uncertain to be used.
  constexpr double kFewest = 30;
  double sum = 0, freedom = 0;
  for (std::size_t first = 0; first < unit.size();) {
    std::size_t end = first;
    while (end < unit.size() && unit[end] == unit[first]) ++end;
    const auto n = static_cast<Eigen::Index>(end - first);
    const auto own = scores.middleCols(static_cast<Eigen::Index>(first), n);
    if (n == 1) return 0;
    const Eigen::VectorXd mean = own.rowwise().mean();
    sum += (own.colwise() - mean).squaredNorm() * static_cast<double>(n) / static_cast<double>(n - 1);
    freedom += static_cast<double>(n - 1);
    first = end;
  }
  return freedom < kFewest ? 0 : sum;
}

/// The same for groups whose clusters are not adjacent.
double within_groups(const Eigen::MatrixXd& scores, const std::vector<std::size_t>& group) {
  std::vector<Eigen::Index> order(group.size());
  std::iota(order.begin(), order.end(), 0);
  const auto of = [&](Eigen::Index i) { return group[static_cast<std::size_t>(i)]; };
  std::stable_sort(order.begin(), order.end(), [&](Eigen::Index a, Eigen::Index b) { return of(a) < of(b); });
  std::vector<std::size_t> sorted = group;
  std::sort(sorted.begin(), sorted.end());
  return within_units(scores(Eigen::all, order), sorted);
}

bool looks_at_runs(const Term& term) {
  return std::any_of(term.blocks.begin(), term.blocks.end(),
                     [](const Block& block) { return block.basis.looks_at(Covariate::kRun); });
}

/// Random signs that a threshold comes from. More make it less uncertain, and cost a matrix column each.
constexpr Eigen::Index kFlips = 400;
/// The fewest degrees of freedom of a statistic that a few clusters dominate.
constexpr double kFewestDegrees = 0.5;

/// Random signs, one row per cluster and one column per flip.
Eigen::MatrixXd signs(Eigen::Index clusters, std::uint64_t seed) {
  const std::array<std::uint32_t, 2> key{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)};
  return Eigen::MatrixXd::NullaryExpr(clusters, kFlips, [&](Eigen::Index c, Eigen::Index f) {
    const auto word = philox4x32({static_cast<std::uint32_t>(c), static_cast<std::uint32_t>(f), 0, 0}, key)[0];
    return (word & 1) != 0 ? 1.0 : -1.0;
  });
}

/// W with W I W' = 1, for the information I of columns whose prior has these standard deviations. Without
/// directions that have no information, or that the model already contains.
Eigen::MatrixXd whitening(const Eigen::MatrixXd& information, const Eigen::VectorXd& scale) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scale.asDiagonal() * information * scale.asDiagonal());
  const double least = std::max(1e-7 * eigen.eigenvalues().maxCoeff(), 1.0);
  std::vector<Eigen::Index> kept;
  for (Eigen::Index i = 0; i < scale.size(); ++i)
    if (eigen.eigenvalues()[i] > least) kept.push_back(i);
  Eigen::MatrixXd whiten(static_cast<Eigen::Index>(kept.size()), scale.size());
  for (std::size_t i = 0; i < kept.size(); ++i) {
    whiten.row(static_cast<Eigen::Index>(i)) = eigen.eigenvectors().col(kept[i]).transpose() * scale.asDiagonal() /
                                               std::sqrt(eigen.eigenvalues()[kept[i]]);
  }
  return whiten;
}

}  // namespace

ColumnGroups columns_read_by_test(const MotionModel& model, const Dictionary& dictionary) {
  ColumnGroups read{kBaseColumns, {}};
  for (const Term& term : model.terms) read.with_all += term.coefficients.size();
  for (const Hypothesis& hypothesis : dictionary.hypotheses) {
    std::vector<Eigen::Index>& group = read.groups.emplace_back();
    for (const Eigen::Index column : hypothesis.columns) group.push_back(read.with_all + column);
  }
  return read;
}

/// The model's columns except one term's, with what reduces other columns by them.
struct ScoreTest::Beside {
  struct Fold {
    const Eigen::MatrixXd* information;  ///< of all columns
    Eigen::MatrixXd own;                 ///< of these columns
    Eigen::VectorXd score;               ///< of all columns, without the term
  };
  std::vector<Eigen::Index> columns;
  Eigen::VectorXd prior, pull;          ///< the precision of their prior, and its gradient
  Eigen::LDLT<Eigen::MatrixXd> solver;  ///< of their information and prior
  std::vector<Fold> by_unit, by_cluster;
};

struct ScoreTest::Reduced {
  Eigen::MatrixXd information;
  Eigen::VectorXd score;
  std::vector<Eigen::MatrixXd> fold_information;
  std::vector<Eigen::VectorXd> fold_score;
};

ScoreTest::Folds::Folds(std::size_t count, Eigen::Index columns)
    : information(count, Eigen::MatrixXd::Zero(columns, columns)), score(count, Eigen::VectorXd::Zero(columns)) {}

ScoreTest::ScoreTest(const Fitter& fitter, const MotionModel& model, const std::vector<Unit>& units,
                     const Dictionary& dictionary)
    : model_(model), dictionary_(dictionary), threads_(fitter.threads()) {
  const Eigen::Index all = units.front().information.rows();
  own_ = all - dictionary.columns();
  information_ = Eigen::MatrixXd::Zero(all, all);
  score_ = Eigen::VectorXd::Zero(all);
  by_unit_ = Folds(std::min(kFolds, units.size()), all);
  by_cluster_ = Folds(kFolds, all);
  Eigen::Index clusters = 0;
  for (const Unit& unit : units) clusters += unit.cluster_scores.cols();
  clusters_.resize(all, clusters);
  Eigen::Index next = 0;
  std::vector<std::array<double, kFolds>> shares(units.size());  // of a unit's clusters, by fold
  for (std::size_t u = 0; u < units.size(); ++u) {
    by_unit_.score[u % by_unit_.score.size()] += units[u].score;
    // Clusters have about equal length and information.
    const Eigen::Index stretches = units[u].cluster_scores.cols();
    for (Eigen::Index k = 0; k < stretches; ++k) {
      const std::size_t of = (static_cast<std::size_t>(k) + u) % kFolds;
      by_cluster_.score[of] += units[u].cluster_scores.col(k);
      shares[u][of] += 1 / static_cast<double>(stretches);
    }
    score_ += units[u].score;
    cluster_unit_.insert(cluster_unit_.end(), static_cast<std::size_t>(units[u].cluster_scores.cols()), u);
    cluster_run_.insert(cluster_run_.end(), units[u].cluster_run.begin(), units[u].cluster_run.end());
    clusters_.middleCols(next, units[u].cluster_scores.cols()) = units[u].cluster_scores;
    next += units[u].cluster_scores.cols();
  }
  in_blocks(all, threads_, [&](Eigen::Index start, Eigen::Index count) {
    const auto add = [&](Eigen::MatrixXd& to, double share, const Unit& unit) {
      to.middleCols(start, count) += share * unit.information.middleCols(start, count);
    };
    for (std::size_t u = 0; u < units.size(); ++u) {
      add(by_unit_.information[u % by_unit_.score.size()], 1, units[u]);
      add(information_, 1, units[u]);
      for (std::size_t f = 0; f < kFolds; ++f)
        if (shares[u][f] > 0) add(by_cluster_.information[f], shares[u][f], units[u]);
    }
  });
  // Prior precision of the model's columns.
  Eigen::MatrixXd base = Eigen::MatrixXd::Zero(all, all);
  Eigen::VectorXd from = Eigen::VectorXd::Zero(all);
  fitter.add_base_prior(model, base, from);
  prior_ = Eigen::VectorXd::Zero(own_);
  prior_.head(kBaseColumns) = base.diagonal().head(kBaseColumns);
  Eigen::Index first = kBaseColumns;
  for (const Term& term : model.terms) {
    const Eigen::Index n = term.coefficients.size();
    prior_.segment(first, n) = term.precision;
    from.segment(first, n) -= term.precision.cwiseProduct(term.coefficients);
    first += n;
  }
  score_ += from;
  pull_ = from.head(own_);
}

ScoreTest::Beside ScoreTest::beside(int without_term) const {
  Beside out;
  for (Eigen::Index i = 0; i < kBaseColumns; ++i) out.columns.push_back(i);
  Eigen::VectorXd taken_out = Eigen::VectorXd::Zero(information_.rows());
  Eigen::Index first = kBaseColumns;
  for (std::size_t t = 0; t < model_.terms.size(); ++t) {
    const Eigen::Index n = model_.terms[t].coefficients.size();
    if (static_cast<int>(t) == without_term) {
      taken_out.segment(first, n) = model_.terms[t].coefficients;
    } else {
      for (Eigen::Index i = 0; i < n; ++i) out.columns.push_back(first + i);
    }
    first += n;
  }
  out.prior = prior_(out.columns);
  out.pull = pull_(out.columns);
  Eigen::MatrixXd own = information_(out.columns, out.columns);
  own.diagonal() += out.prior;
  out.solver.compute(own);
  for (const bool by_cluster : {false, true}) {
    const Folds& folds = by_cluster ? by_cluster_ : by_unit_;
    for (std::size_t f = 0; f < folds.score.size(); ++f) {
      const Eigen::MatrixXd& information = folds.information[f];
      Beside::Fold& fold = (by_cluster ? out.by_cluster : out.by_unit).emplace_back();
      fold.information = &information;
      fold.own = information(out.columns, out.columns);
      fold.score = folds.score[f];
      if (without_term >= 0) fold.score += information * taken_out;
    }
  }
  return out;
}

/// Information and score of columns, reduced by those beside them, which give way to them against their prior: of all
/// measurements with that prior, and of each fold, which does not contain it.
ScoreTest::Reduced ScoreTest::reduce(const std::vector<Eigen::Index>& columns, const Beside& beside,
                                     bool by_cluster) const {
  const Eigen::MatrixXd by = beside.solver.solve(information_(beside.columns, columns));
  Reduced out;
  out.information = by.transpose() * beside.prior.asDiagonal() * by;
  out.score = -by.transpose() * beside.pull;
  for (const Beside::Fold& fold : by_cluster ? beside.by_cluster : beside.by_unit) {
    const Eigen::MatrixXd part = (*fold.information)(beside.columns, columns);
    Eigen::MatrixXd information = (*fold.information)(columns, columns);
    information -= by.transpose() * part;
    information -= part.transpose() * by;
    information += by.transpose() * fold.own * by;
    out.information += information;
    out.fold_information.push_back(std::move(information));
    out.fold_score.push_back(fold.score(columns) - by.transpose() * fold.score(beside.columns));
    out.score += out.fold_score.back();
  }
  return out;
}

/// For coefficients b ~ N(0, (t scale)^2): log evidence over b = 0 at the best t, and the cross-validated gain
/// there.
Finding ScoreTest::evidence_of(const Reduced& reduced, const Eigen::VectorXd& scale, double log_choices) const {
  Finding found;
  const Eigen::MatrixXd scaled = scale.asDiagonal() * reduced.information * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scaled);
  const Eigen::VectorXd values = eigen.eigenvalues().cwiseMax(0);
  Eigen::VectorXd along = eigen.eigenvectors().transpose() * scale.cwiseProduct(reduced.score);
  // Directions without information carry rounding errors only.
  for (Eigen::Index i = 0; i < values.size(); ++i)
    if (values[i] < std::max(1e-7 * values.maxCoeff(), 1.0)) along[i] = 0;
  double best = 0, best_t = 0;
  for (int step = 0; step <= 28; ++step) {
    const double t = std::pow(10.0, -4.0 + step / 6.0), t2 = t * t;
    double value = 0;
    for (Eigen::Index i = 0; i < values.size(); ++i) {
      const double with = 1 + t2 * values[i];
      value += 0.5 * (t2 * along[i] * along[i] / with - std::log(with));
    }
    if (best_t == 0 || value > best) {
      best = value;
      best_t = t;
    }
  }
  found.relative_scale = best_t;
  found.evidence = best - log_choices - 1;  // 1: the price of choosing t
  found.degrees = static_cast<int>((values.array() > 1e-9 * values.maxCoeff()).count());
  // Cross-validation.
  const Eigen::VectorXd precision = (best_t * scale).cwiseAbs2().cwiseInverse();
  for (std::size_t f = 0; f < reduced.fold_information.size(); ++f) {
    Eigen::MatrixXd rest = reduced.information - reduced.fold_information[f];
    rest.diagonal() += precision;
    const Eigen::VectorXd b = rest.ldlt().solve(reduced.score - reduced.fold_score[f]);
    found.held_out += b.dot(reduced.fold_score[f]) - 0.5 * b.dot(reduced.fold_information[f] * b);
  }
  return found;
}

Finding ScoreTest::evidence_of(const Hypothesis& hypothesis, const Beside& beside) const {
  std::vector<Eigen::Index> columns;
  for (const Eigen::Index c : hypothesis.columns) columns.push_back(own_ + c);
  return evidence_of(reduce(columns, beside, of_robots(hypothesis)), dictionary_.scale(hypothesis.columns),
                     hypothesis.log_choices);
}

Finding ScoreTest::evidence_of(const Hypothesis& hypothesis, int without_term) const {
  return evidence_of(hypothesis, beside(without_term));
}

Finding ScoreTest::evidence_of_term(int term) const {
  Eigen::Index first = kBaseColumns;
  for (int t = 0; t < term; ++t) first += model_.terms[static_cast<std::size_t>(t)].coefficients.size();
  const Term& own = model_.terms[static_cast<std::size_t>(term)];
  std::vector<Eigen::Index> columns;
  for (Eigen::Index i = 0; i < own.coefficients.size(); ++i) columns.push_back(first + i);
  const bool of_each = std::any_of(own.blocks.begin(), own.blocks.end(),
                                   [](const Block& block) { return block.basis.looks_at(Covariate::kRobot); });
  return evidence_of(reduce(columns, beside(term), of_each), own.precision.cwiseInverse().cwiseSqrt(), 0);
}

std::vector<Finding> ScoreTest::evidence_of_each(const std::vector<const Hypothesis*>& hypotheses,
                                                 int without_term) const {
  std::vector<Finding> out(hypotheses.size());
  const Beside others = beside(without_term);
  os::in_parallel(out.size(), threads_, [&](std::size_t h) { out[h] = evidence_of(*hypotheses[h], others); });
  return out;
}

/// The whole dictionary at once, reduced by the model.
ScoreTest::ReducedDictionary ScoreTest::reduced_dictionary() const {
  const Eigen::Index columns = dictionary_.columns();
  Eigen::MatrixXd own = information_.topLeftCorner(own_, own_);
  own.diagonal() += prior_;
  const Eigen::MatrixXd by = own.ldlt().solve(information_.topRightCorner(own_, columns));
  ReducedDictionary out{Eigen::MatrixXd(columns, columns), Eigen::MatrixXd(columns, clusters_.cols()),
                        score_.tail(columns) - by.transpose() * score_.head(own_)};
  in_blocks(columns, threads_, [&](Eigen::Index first, Eigen::Index count) {
    out.information.middleCols(first, count) =
        information_.block(own_, own_ + first, columns, count) -
        information_.bottomLeftCorner(columns, own_) * by.middleCols(first, count);
    out.clusters.middleRows(first, count) = clusters_.middleRows(own_ + first, count) -
                                            by.middleCols(first, count).transpose() * clusters_.topRows(own_);
  });
  return out;
}

/// Tests one hypothesis. `flips_log10_p` becomes its log10 p value under each flip; it stays if no column has information.
Finding ScoreTest::finding_of(std::size_t h, const ReducedDictionary& reduced, const Eigen::MatrixXd& flipped,
                              Tail tail, Eigen::VectorXd& flips_log10_p) const {
  const Hypothesis& hypothesis = dictionary_.hypotheses[h];
  const std::vector<Eigen::Index>& columns = hypothesis.columns;
  Finding finding;
  finding.hypothesis = h;
  const Eigen::VectorXd scale = dictionary_.scale(columns);
  const Eigen::MatrixXd whiten = whitening(reduced.information(columns, columns), scale);
  finding.degrees = static_cast<int>(whiten.rows());
  if (whiten.rows() == 0) return finding;
  const auto degrees = static_cast<double>(whiten.rows());
  finding.statistic = (whiten * reduced.score(columns)).squaredNorm();
  const Eigen::VectorXd statistics =
      (whiten * Eigen::MatrixXd(flipped(columns, Eigen::all))).colwise().squaredNorm();
  const double dispersion = std::max(1.0, statistics.mean() / degrees);
  double own_dispersion = dispersion;
  // Differences between robots or runs are signal for such hypotheses, not noise.
  const bool robots = of_robots(hypothesis);
  if (robots || looks_at_runs(dictionary_.term_of(hypothesis, 1))) {
    const Eigen::MatrixXd scores = whiten * Eigen::MatrixXd(reduced.clusters(columns, Eigen::all));
    const double within = robots ? within_units(scores, cluster_unit_) : within_groups(scores, cluster_run_);
    if (within > 0) own_dispersion = std::clamp(within / degrees, 1.0, dispersion);
  }
  double freedom = degrees;
  if (tail == Tail::kOfClusters) {
    const double variance = (statistics.array() - statistics.mean()).square().mean() / (dispersion * dispersion);
    freedom =
        std::clamp(2 * degrees * degrees / std::max(variance, 1e-9), std::min(kFewestDegrees, degrees), degrees);
  }
  const auto log10_p_of = [&](double statistic) {
    return stats::log10_chi_squared_tail(statistic * freedom / degrees, freedom);
  };
  finding.log10_p = log10_p_of(finding.statistic / own_dispersion);
  for (Eigen::Index f = 0; f < kFlips; ++f) flips_log10_p(f) = log10_p_of(statistics[f] / dispersion);
  return finding;
}

ScoreTest::Outcome ScoreTest::test(std::uint64_t seed, Tail tail) const {
  const ReducedDictionary reduced = reduced_dictionary();
  const Eigen::MatrixXd flips = signs(reduced.clusters.cols(), seed);
  Eigen::MatrixXd flipped(reduced.clusters.rows(), kFlips);
  in_blocks(flipped.rows(), threads_, [&](Eigen::Index first, Eigen::Index count) {
    flipped.middleRows(first, count).noalias() = reduced.clusters.middleRows(first, count) * flips;
  });
  Outcome out;
  out.findings.resize(dictionary_.hypotheses.size());
  std::vector<Eigen::VectorXd> log10_p(out.findings.size(), Eigen::VectorXd::Zero(kFlips));
  os::in_parallel(out.findings.size(), threads_,
                  [&](std::size_t h) { out.findings[h] = finding_of(h, reduced, flipped, tail, log10_p[h]); });
  Eigen::VectorXd worst = Eigen::VectorXd::Zero(kFlips);
  for (const Eigen::VectorXd& one : log10_p) worst = worst.cwiseMin(one);
  // The minimum over many p values follows a Gumbel distribution on the log scale. With exact p values, its standard
  // deviation is pi / sqrt(6) / ln 10 = 0.56. The least one keeps a threshold strict where the flips happen to agree.
  constexpr double kLeastSd = 0.4;
  const double mean = worst.mean();
  const double sd = std::sqrt((worst.array() - mean).square().mean());
  out.threshold_log10_p = -stats::gumbel_quantile(1 - kFamilyAlarm, -mean, std::max(sd, kLeastSd));
  const Beside model = beside(-1);
  os::in_parallel(out.findings.size(), threads_, [&](std::size_t h) {
    Finding& finding = out.findings[h];
    if (finding.log10_p > out.threshold_log10_p) return;
    const Finding result = evidence_of(dictionary_.hypotheses[h], model);
    finding.evidence = result.evidence;
    finding.relative_scale = result.relative_scale;
    finding.held_out = result.held_out;
  });
  return out;
}

}  // namespace kilotwin::identify
