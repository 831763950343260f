// A small neural network of what the base model's rates leave: two hidden layers of 24 tanh units, trained by Adam with
// weight decay and early stopping: D. Kingma, J. Ba, Adam (ICLR 2015).
#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>

#include "tests/identify/rivals/columns.hpp"
#include "tests/identify/truth/dice.hpp"

namespace kilotwin::truth {
namespace {

constexpr Eigen::Index kHidden = 24, kInputs = kCovariates + 3;

void inputs_of(const Instant& at, Eigen::Ref<Eigen::VectorXd> to) {
  covariates_of(at, to.head(kCovariates));
  for (Eigen::Index m = 0; m < 3; ++m) to[kCovariates + m] = static_cast<std::size_t>(m) == command_of(at) ? 1 : 0;
}

/// Weights with a last column for the constant, and Adam's moments.
struct Layer {
  Eigen::MatrixXd weights, gradient, mean, square;
  Layer(Eigen::Index out, Eigen::Index in, double size, Dice& dice)
      : weights(out, in + 1), gradient(out, in + 1), mean(Eigen::MatrixXd::Zero(out, in + 1)), square(mean) {
    for (Eigen::Index i = 0; i < weights.size(); ++i)
      weights.data()[i] = size * dice.normal() / std::sqrt(static_cast<double>(in));
  }
  [[nodiscard]] Eigen::MatrixXd of(const Eigen::MatrixXd& in) const {
    return (weights.leftCols(weights.cols() - 1) * in).colwise() + weights.col(weights.cols() - 1);
  }
  void step(double rate, int t) {
    constexpr double kDecay = 1e-3;
    mean = 0.9 * mean + 0.1 * gradient;
    square = 0.999 * square + 0.001 * gradient.cwiseAbs2();
    const double a = 1 - std::pow(0.9, t), b = 1 - std::pow(0.999, t);
    weights.array() -=
        rate * ((mean.array() / a) / ((square.array() / b).sqrt() + 1e-8) + kDecay * weights.array());
  }
};

struct Network {
  std::vector<Layer> layers;
  explicit Network(Dice& dice) {
    layers.emplace_back(kHidden, kInputs, 1, dice);
    layers.emplace_back(kHidden, kHidden, 1, dice);
    layers.emplace_back(3, kHidden, 0.1, dice);
  }
  [[nodiscard]] Eigen::MatrixXd of(const Eigen::MatrixXd& in) const {
    return layers[2].of(layers[1].of(layers[0].of(in).array().tanh().matrix()).array().tanh().matrix());
  }
  /// One step down the mean square error.
  void learn(const Eigen::MatrixXd& in, const Eigen::MatrixXd& y, double rate, int t) {
    const Eigen::MatrixXd a = layers[0].of(in).array().tanh(), b = layers[1].of(a).array().tanh();
    Eigen::MatrixXd back = (layers[2].of(b) - y) / static_cast<double>(in.cols());
    const auto gradient = [](Layer& layer, const Eigen::MatrixXd& d, const Eigen::MatrixXd& input) {
      layer.gradient.leftCols(input.rows()) = d * input.transpose();
      layer.gradient.col(input.rows()) = d.rowwise().sum();
    };
    gradient(layers[2], back, b);
    back = (layers[2].weights.leftCols(kHidden).transpose() * back).cwiseProduct((1 - b.array().square()).matrix());
    gradient(layers[1], back, a);
    back = (layers[1].weights.leftCols(kHidden).transpose() * back).cwiseProduct((1 - a.array().square()).matrix());
    gradient(layers[0], back, in);
    for (Layer& layer : layers) layer.step(rate, t);
  }
};

}  // namespace

Rival neural_network(const std::vector<RateRow>& rows, int robots) {
  const Eigen::Index columns = base_columns(robots);
  const Eigen::MatrixXd base = means(rows, columns,
                                     [&](const Instant&at, Eigen::VectorXd&to) { base_of(at, robots, to); }),
                        y = rates_of(rows);
  const Eigen::MatrixXd by_base = base_coefficients(rows, robots);
  Eigen::MatrixXd left = (y - base * by_base).transpose();
  const Eigen::Vector3d sd = (left.rowwise().squaredNorm() / static_cast<double>(left.cols())).cwiseSqrt();
  left = sd.cwiseInverse().asDiagonal() * left;
  const Eigen::MatrixXd in =
      means(rows, kInputs, [](const Instant& at, Eigen::VectorXd& to) { inputs_of(at, to); }).transpose();
  std::vector<Eigen::Index> train, held;
  for (std::size_t r = 0; r < rows.size(); ++r)
    (rows[r].track % 5 == 0 ? held : train).push_back(static_cast<Eigen::Index>(r));

  Dice dice(20150507);
  Network network(dice), best = network;
  double least = INFINITY;
  constexpr int kEpochs = 80, kPatience = 12;
  constexpr std::size_t kBatch = 128;
  for (int epoch = 0, step = 0, worse = 0; epoch < kEpochs && worse < kPatience; ++epoch) {
    for (std::size_t i = train.size(); i > 1; --i)
      std::swap(train[i - 1], train[static_cast<std::size_t>(dice.pick(static_cast<int>(i)))]);
    for (std::size_t first = 0; first + kBatch <= train.size(); first += kBatch) {
      const std::vector<Eigen::Index> batch(train.begin() + static_cast<std::ptrdiff_t>(first),
                                            train.begin() + static_cast<std::ptrdiff_t>(first + kBatch));
      const double rate = 3e-3 * (1 - static_cast<double>(epoch) / kEpochs);
      network.learn(in(Eigen::all, batch), left(Eigen::all, batch), rate, ++step);
    }
    const double error = (network.of(in(Eigen::all, held)) - left(Eigen::all, held)).squaredNorm();
    worse = error < least ? 0 : worse + 1;
    if (error >= least) continue;
    least = error;
    best = network;
  }
  Rival rival;
  rival.straight_mm_s = straight_of(by_base, robots);
  rival.rates = [network = std::make_shared<Network>(best), by_base, sd, columns,
                 robots](const Instant& at) -> Eigen::Vector3d {
    if (at.motion == Motion::kStop) return Eigen::Vector3d::Zero();
    Eigen::VectorXd one(columns), z(kInputs);
    base_of(at, robots, one);
    inputs_of(at, z);
    return by_base.transpose() * one + sd.asDiagonal() * network->of(z);
  };
  return rival;
}

}  // namespace kilotwin::truth
