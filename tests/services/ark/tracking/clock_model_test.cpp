// The clock model against sources whose clocks are known: its laws, then its bounds.
#include "services/ark/tracking/clock_model.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace kilotwin::ark {
namespace {

constexpr double kSecond_ns = 1e9, kUtcAtStart_s = 1.7e9;

/// A camera at 30 Hz whose clock reads offset + (1 + drift) t at the station's time t, and a network with random queues.
class Source {
 public:
  double offset_s = 37, drift = 50e-6;
  double wander = 0;  ///< amplitude of a drift that changes with a period of an hour
  double least_delay_s = 0, queueing_s = 3e-3;
  bool utc = false;
  double utc_error_s = 0;
  double exposure_to_sent_s = 0.012;

  /// Sample `frame`, and the true station time of its capture.
  std::pair<ClockModel::Sample, double> next() {
    const double sent_s = first_s_ + static_cast<double>(frame_) / 30;
    const double capture_s = sent_s - exposure_to_sent_s;
    std::exponential_distribution<double> queue(1);
    const double congestion =
        std::fmod(sent_s, 600) < 60 ? 5 : 1;  // ten minutes long all is well, then a minute is not
    const double arrival_s = sent_s + least_delay_s + queueing_s * congestion * queue(random_);
    ClockModel::Sample sample;
    sample.frame = frame_++;
    sample.capture_ns = reading_ns(capture_s);
    sample.sent_ns = reading_ns(sent_s);
    sample.shows_utc = utc;
    sample.arrival_ns = std::llround(arrival_s * kSecond_ns);
    sample.arrival_utc_ns = std::llround((arrival_s + kUtcAtStart_s) * kSecond_ns);
    return {sample, capture_s};
  }
  void restart(double offset) {
    first_s_ += static_cast<double>(frame_) / 30 + 5;
    frame_ = 0;
    offset_s = offset;
  }
  [[nodiscard]] std::int64_t reading_ns(double t_s) const {
    if (utc) return std::llround((t_s + kUtcAtStart_s + utc_error_s) * kSecond_ns);
    constexpr double kHour_s = 3600, kTurn = 2 * 3.14159265358979;
    const double wandered = wander * kHour_s / kTurn * (1 - std::cos(kTurn * t_s / kHour_s));
    return std::llround((offset_s + (1 + drift) * t_s + wandered) * kSecond_ns);
  }

 private:
  std::mt19937_64 random_{7};
  std::uint64_t frame_ = 1;
  double first_s_ = 1000;
};

/// Errors of stamps over `seconds`, s; those of the first kWarmUp_s apart.
struct Errors {
  std::vector<double> warming, warm;
  static double quantile(std::vector<double> values, double p) {
    std::sort(values.begin(), values.end());
    return values[static_cast<std::size_t>(p * static_cast<double>(values.size() - 1))];
  }
};

Errors errors_of(ClockModel& model, Source& source, double seconds) {
  Errors errors;
  for (int n = 0; n < seconds * 30; ++n) {
    const auto [sample, capture_s] = source.next();
    const auto stamp = model.take(sample);
    EXPECT_TRUE(stamp);
    if (!stamp) continue;
    EXPECT_LE(stamp->capture_ns, sample.arrival_ns);
    const double error_s = std::abs(static_cast<double>(stamp->capture_ns) / kSecond_ns - capture_s);
    (n < ClockModel::kWarmUp_s * 30 ? errors.warming : errors.warm).push_back(error_s);
  }
  return errors;
}

/// Two hours of source time; tracked_day does a whole day.
TEST(ClockModel, StampsWithinAMillisecond) {
  for (const double wander : {0.0, 5e-6}) {
    Source source;
    source.wander = wander;
    ClockModel model;
    const Errors errors = errors_of(model, source, 2 * 3600);
    const double p99_ms = 1e3 * Errors::quantile(errors.warm, 0.99),
                 worst_ms = 1e3 * Errors::quantile(errors.warm, 1);
    RecordProperty(wander > 0 ? "p99_us_wandering" : "p99_us", static_cast<int>(p99_ms * 1e3));
    RecordProperty(wander > 0 ? "worst_us_wandering" : "worst_us", static_cast<int>(worst_ms * 1e3));
    EXPECT_LT(p99_ms, 1);
    EXPECT_NEAR(model.drift_ppm(), -50, wander > 0 ? 20 : 10);
    EXPECT_EQ(model.restarts(), 0u);
    EXPECT_EQ(model.refused(), 0u);
    // While it warms up the drift is unknown: 50 ppm of 10 s, and the least queue so far.
    EXPECT_LT(1e3 * Errors::quantile(errors.warming, 0.99), 15);
  }
}

TEST(ClockModel, IsExactWithoutQueues) {
  Source source;
  source.queueing_s = 0;
  ClockModel model;
  const Errors errors = errors_of(model, source, 300);
  EXPECT_LT(Errors::quantile(errors.warm, 1), 2e-6);
  EXPECT_NEAR(model.drift_ppm(), -50, 0.1);
}

/// A limit of every one-way measurement: the least delay goes into the stamp, whole.
TEST(ClockModel, TheLeastDelayStaysInTheStamp) {
  Source source;
  source.queueing_s = 0;
  source.least_delay_s = 0.004;
  ClockModel model;
  const Errors errors = errors_of(model, source, 60);
  EXPECT_NEAR(Errors::quantile(errors.warm, 0.5), 0.004, 1e-5);
}

TEST(ClockModel, ARestartedSourceIsEstimatedAnew) {
  Source source;
  ClockModel model;
  errors_of(model, source, 120);
  source.restart(-4e5);
  const Errors errors = errors_of(model, source, 120);
  EXPECT_EQ(model.restarts(), 1u);
  EXPECT_LT(Errors::quantile(errors.warm, 0.99), 1e-3);
}

TEST(ClockModel, AClockThatIsSetIsNoticed) {
  for (const double step_s : {-3600.0, -0.5, 0.2, 37.0}) {
    Source source;
    ClockModel model;
    errors_of(model, source, 60);
    source.offset_s += step_s;
    for (int n = 0; n < 60; ++n) static_cast<void>(model.take(source.next().first));
    EXPECT_EQ(model.restarts(), 1u) << step_s;
    EXPECT_LE(model.refused(), 12u) << step_s;
    EXPECT_LT(Errors::quantile(errors_of(model, source, 60).warm, 0.99), 1.5e-3) << step_s;
  }
}

TEST(ClockModel, SingleWrongStampsHarmNothing) {
  Source source;
  ClockModel model;
  errors_of(model, source, 60);
  for (int n = 0; n < 20; ++n) {
    auto [wrong, capture_s] = source.next();
    wrong.sent_ns += n % 2 == 0 ? 400'000'000 : 5'000'000'000;
    wrong.capture_ns += n % 2 == 0 ? 400'000'000 : 5'000'000'000;
    EXPECT_FALSE(model.take(wrong));
    for (int k = 0; k < 40; ++k) static_cast<void>(model.take(source.next().first));
  }
  EXPECT_EQ(model.refused(), 20u);
  EXPECT_EQ(model.restarts(), 0u);
  EXPECT_LT(Errors::quantile(errors_of(model, source, 60).warm, 0.99), 1e-3);
}

TEST(ClockModel, OldFramesAreRefused) {
  Source source;
  ClockModel model;
  const auto first = source.next().first, second = source.next().first;
  EXPECT_TRUE(model.take(first));
  EXPECT_TRUE(model.take(second));
  EXPECT_FALSE(model.take(second));
  EXPECT_FALSE(model.take(first));
  EXPECT_EQ(model.refused(), 2u);
}

TEST(ClockModel, TakesUtcAsOfferedUnlessItCannotBe) {
  Source good;
  good.utc = true;
  good.queueing_s = 0.05;
  ClockModel model;
  for (int n = 0; n < 100; ++n) {
    const auto [sample, capture_s] = good.next();
    const auto stamp = model.take(sample);
    ASSERT_TRUE(stamp && stamp->offered);
    EXPECT_NEAR(static_cast<double>(stamp->capture_ns) / kSecond_ns, capture_s, 1e-6);  // whatever the queue
  }
  EXPECT_EQ(model.wrong_utc_s(), 0);

  Source tai;
  tai.utc = true;
  tai.utc_error_s = ClockModel::kTaiLead_s;
  ClockModel estimated;
  const Errors errors = errors_of(estimated, tai, 60);
  EXPECT_NEAR(estimated.wrong_utc_s(), ClockModel::kTaiLead_s, 0.2);
  EXPECT_LT(Errors::quantile(errors.warm, 0.99), 1e-3);
}

}  // namespace
}  // namespace kilotwin::ark
