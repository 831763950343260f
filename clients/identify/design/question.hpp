/// The question that a planned recording is to answer: parameters of the present model, or which of several models is true.
///
/// Everything is linear about the present model. A column is the derivative of the predicted tracks by one number: a parameter of the
/// base model, the amplitude of an effect, its trend over a covariate. Models differ by the effects that one has and another has not.
/// Information is counted in nat. Of parameters: half the growth of the log determinant of their information (D-optimality). Of two
/// models: the expected log likelihood ratio if either is true and the parameters of the other are fitted to the data (T-optimality).
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "idl/identification.pb.h"
#include "idl/model.pb.h"

namespace kilotwin::identify {

struct DesignColumn {
  std::string name;
  double sd = 1;    ///< present uncertainty of the number
  double step = 1;  ///< of the derivative
  std::function<void(proto::Model&, double)> change;
};

/// A model that may be true.
struct Candidate {
  std::string name;
  std::vector<Eigen::Index> fitted;     ///< columns of its parameters
  std::vector<Eigen::Index> amplitude;  ///< the column of all its own effects; empty: it has none
};

struct DesignQuestion {
  proto::Model present;  ///< without the noise of the tracker
  std::vector<DesignColumn> columns;
  std::vector<Candidate> models;  ///< the present model first

  [[nodiscard]] bool of_parameters() const { return models.size() == 1; }
};

/// The parameters of the base model, and the amplitude of each effect that `result` names.
[[nodiscard]] DesignQuestion question_of_parameters(const proto::Model&, const identification::Result&);

/// The question which model is true, the present one first. Parameters of each: those of the base model; an amplitude and a trend over each covariate of the
/// effects that not all models have. Throws UserError if a model has the effects of an earlier one.
[[nodiscard]] DesignQuestion question_of_models(const std::vector<std::pair<std::string, proto::Model>>& models,
                                                const identification::Result&, double duration_s, double reach_mm);

/// Information in nat. `products`: of all whitened columns with each other, summed over robots. With several models: of the pair that
/// it distinguishes least.
[[nodiscard]] double information_nat(const DesignQuestion&, const Eigen::MatrixXd& products);

/// Standard deviations of all columns after data with these products.
[[nodiscard]] std::vector<double> sds_after(const DesignQuestion&, const Eigen::MatrixXd& products);

}  // namespace kilotwin::identify
