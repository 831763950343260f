#include "clients/track/radial_votes.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "clients/track/brightness.hpp"
#include "core/stats/quantiles.hpp"

namespace kilotwin::track {
namespace {

constexpr double kWorkRadius_px = 8;
constexpr double kLeastVotes = 0.22;   ///< of an ideal disc
constexpr float kLeastSlope = 0.025F;  ///< of log brightness, per pixel of the reduced picture

float median_of(const cv::Mat& values) {
  // A sample of the pixels is enough.
  std::vector<float> some;
  for (int row = 0; row < values.rows; row += 3) {
    const float* line = values.ptr<float>(row);
    for (int column = row % 5; column < values.cols; column += 5) some.push_back(line[column]);
  }
  return stats::upper_median(std::move(some));
}

/// Whether the slope at a pixel is the steepest along its direction.
bool is_ridge(const cv::Mat& steep, int row, int column, float dx, float dy) {
  const float here = steep.at<float>(row, column);
  const int sx = std::abs(dx) > 0.4142F * std::abs(dy) ? (dx > 0 ? 1 : -1) : 0;
  const int sy = std::abs(dy) > 0.4142F * std::abs(dx) ? (dy > 0 ? 1 : -1) : 0;
  return here >= steep.at<float>(row + sy, column + sx) && here > steep.at<float>(row - sy, column - sx);
}

/// The votes of all edges of a reduced picture, blurred.
cv::Mat votes_of(const cv::Mat& logs, double radius) {
  cv::Mat dx, dy, steep;
  cv::Scharr(logs, dx, CV_32F, 1, 0, 1.0 / 32);
  cv::Scharr(logs, dy, CV_32F, 0, 1, 1.0 / 32);
  cv::magnitude(dx, dy, steep);
  const float bound = std::max(kLeastSlope, 2.5F * median_of(steep));
  cv::Mat votes = cv::Mat::zeros(logs.size(), CV_32F);
  for (int row = 1; row + 1 < logs.rows; ++row) {
    const float* slope = steep.ptr<float>(row);
    const float* x_slope = dx.ptr<float>(row);
    const float* y_slope = dy.ptr<float>(row);
    for (int column = 1; column + 1 < logs.cols; ++column) {
      const float here = slope[column];
      if (here < bound || !is_ridge(steep, row, column, x_slope[column], y_slope[column])) continue;
      const float weight = std::min(1.0F, here / (2 * bound));
      const auto ux = static_cast<double>(x_slope[column] / here), uy = static_cast<double>(y_slope[column] / here);
      for (const double of : {0.9, 1.0, 1.1}) {
        const int x = cvRound(column - of * radius * ux), y = cvRound(row - of * radius * uy);
        if (x >= 0 && y >= 0 && x < votes.cols && y < votes.rows) votes.at<float>(y, x) += weight;
      }
    }
  }
  const double sigma = 0.14 * radius;
  cv::GaussianBlur(votes, votes, cv::Size(), sigma, sigma, cv::BORDER_CONSTANT);
  return votes;
}

}  // namespace

std::vector<Candidate> vote(const cv::Mat& grey, double radius_px, std::size_t most) {
  const double reduction = std::max(1.0, radius_px / kWorkRadius_px);
  cv::Mat reduced = grey;
  if (reduction > 1.05) cv::resize(grey, reduced, cv::Size(), 1 / reduction, 1 / reduction, cv::INTER_AREA);
  if (reduced.cols < 8 || reduced.rows < 8) return {};
  const double scale_x = static_cast<double>(grey.cols) / reduced.cols;
  const double scale_y = static_cast<double>(grey.rows) / reduced.rows;
  const double radius = radius_px / (0.5 * (scale_x + scale_y));
  cv::Mat logs;
  cv::LUT(reduced, log_table(), logs);
  cv::GaussianBlur(logs, logs, cv::Size(), 0.9, 0.9);
  const cv::Mat votes = votes_of(logs, radius);

  // A ring of 2 pi r votes spread over the blur and half a pixel of uncertainty.
  const double sigma = 0.14 * radius;
  const double ideal = radius / (sigma * sigma + 0.8);
  cv::Mat highest;
  const int reach = std::max(1, cvRound(0.6 * radius));
  cv::dilate(votes, highest, cv::getStructuringElement(cv::MORPH_RECT, cv::Size(2 * reach + 1, 2 * reach + 1)));
  std::vector<Candidate> found;
  for (int row = 0; row < votes.rows; ++row) {
    const float* line = votes.ptr<float>(row);
    const float* top = highest.ptr<float>(row);
    for (int column = 0; column < votes.cols; ++column) {
      if (line[column] < top[column] || line[column] < kLeastVotes * ideal) continue;
      const Point centre{(column + 0.5) * scale_x - 0.5, (row + 0.5) * scale_y - 0.5};
      found.push_back({{centre, radius_px}, static_cast<double>(line[column]) / ideal});
    }
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const Candidate& a, const Candidate& b) { return a.votes > b.votes; });
  if (found.size() > most) found.resize(most);
  return found;
}

}  // namespace kilotwin::track
