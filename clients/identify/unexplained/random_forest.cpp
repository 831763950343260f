#include "clients/identify/unexplained/random_forest.hpp"

#include <array>
#include <opencv2/core.hpp>
#include <opencv2/ml.hpp>

#include "core/os/worker_pool.hpp"

namespace kilotwin::identify {
namespace {

/// Deep trees with leaves of a few examples, averaged. More trees change the error by less than a percent.
constexpr int kTrees = 80, kDepth = 12, kFewestInLeaf = 12;
constexpr int kSeed = 20180729;

/// Row-major copy, as OpenCV stores matrices.
cv::Mat matrix_of(const Eigen::MatrixXf& from) {
  cv::Mat to(static_cast<int>(from.rows()), static_cast<int>(from.cols()), CV_32F);
  for (int i = 0; i < to.rows; ++i)
    for (int j = 0; j < to.cols; ++j) to.at<float>(i, j) = from(i, j);
  return to;
}

}  // namespace

struct RandomForest::Forests {
  std::array<cv::Ptr<cv::ml::RTrees>, 2> of;
};

RandomForest::RandomForest(const Eigen::MatrixXf& covariates, const Eigen::MatrixX2f& targets, std::uint32_t threads)
    : forests_(std::make_unique<Forests>()) {
  const cv::Mat inputs = matrix_of(covariates);
  os::in_parallel(forests_->of.size(), threads, [&](std::size_t k) {
    // OpenCV has a generator of random numbers per thread.
    cv::setRNGSeed(kSeed);
    cv::Ptr<cv::ml::RTrees> forest = cv::ml::RTrees::create();
    forest->setMaxDepth(kDepth);
    forest->setMinSampleCount(kFewestInLeaf);
    forest->setActiveVarCount(inputs.cols / 2 + 1);
    forest->setCalculateVarImportance(false);
    forest->setTermCriteria({cv::TermCriteria::MAX_ITER, kTrees, 0});
    forest->train(inputs, cv::ml::ROW_SAMPLE, matrix_of(targets.col(static_cast<Eigen::Index>(k))));
    forests_->of[k] = forest;
  });
}

RandomForest::~RandomForest() = default;

Eigen::MatrixX2f RandomForest::predict(const Eigen::MatrixXf& covariates) const {
  Eigen::MatrixX2f out(covariates.rows(), 2);
  const cv::Mat inputs = matrix_of(covariates);
  for (int k = 0; k < 2; ++k) {
    cv::Mat found;
    forests_->of[static_cast<std::size_t>(k)]->predict(inputs, found);
    for (int i = 0; i < inputs.rows; ++i) out(i, k) = found.at<float>(i, 0);
  }
  return out;
}

}  // namespace kilotwin::identify
