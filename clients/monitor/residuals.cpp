#include "clients/monitor/residuals.hpp"

#include <fmt/format.h>

#include <cmath>

namespace kilotwin::monitor {

Residuals::Residuals(const std::vector<std::uint32_t>& robots) {
  for (const std::uint32_t robot : robots) open_.emplace_back().robot = robot;
}

void Residuals::add(std::size_t entry, const Innovation& innovation, bool is_tested) {
  Residual& residual = open_[entry];
  ++residual.samples;
  residual.headings += innovation.dimensions == 3 ? 1u : 0u;
  residual.tested += is_tested ? 1u : 0u;
  for (std::size_t d = 0; d < innovation.dimensions; ++d) {
    residual.sum[d] += innovation.white[d];
    residual.squares += innovation.white[d] * innovation.white[d];
  }
}

void Residuals::advance(double now_s) {
  const auto second = static_cast<std::int64_t>(std::floor(now_s));
  if (second <= second_) return;
  for (Residual& residual : open_) {
    if (residual.samples > 0) {
      residual.to_s = static_cast<double>(second_ + 1);
      closed_.push_back(residual);
    }
    const std::uint32_t robot = residual.robot;
    residual = {};
    residual.robot = robot;
  }
  second_ = second;
}

std::string residuals_header() { return "time_s,robot,samples,headings,tested,along,across,heading,mean_square"; }

std::string residuals_row(const Residual& residual) {
  const double root = std::sqrt(residual.samples);
  const std::string heading =
      residual.headings == 0 ? "" : fmt::format("{:.4g}", residual.sum[2] / std::sqrt(residual.headings));
  return fmt::format("{:g},{},{},{},{},{:.4g},{:.4g},{},{:.4g}", residual.to_s, residual.robot, residual.samples,
                     residual.headings, residual.tested, residual.sum[0] / root, residual.sum[1] / root, heading,
                     residual.squares / (2 * residual.samples + residual.headings));
}

}  // namespace kilotwin::monitor
