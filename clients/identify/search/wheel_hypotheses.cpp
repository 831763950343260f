#include "clients/identify/search/covariate_hypotheses.hpp"

namespace kilotwin::identify {

void add_wheel_hypotheses(DictionaryBuilder& make, const Extent& extent) {
  using Shape = Factor::Shape;
  constexpr double kWheels = 2;  // choices, for the price of each hypothesis: the left or the right wheel
  const auto each = [&](const char* of, const char* word, const Factor& factor,
                        std::initializer_list<Eigen::Index> sizes) {
    for (const Target wheel : {Target::kGainLeft, Target::kGainRight}) {
      const Eigen::Index base = make.put(wheel, Basis{{factor}});
      for (const Eigen::Index size : sizes)
        make.add(std::string(kSpeed.name) + "-by-" + of, {word}, kSpeed.in_words, some({base}, 0, size), kWheels);
    }
  };
  each("time", "time", over(Shape::kCosines, Covariate::kTime, 0, extent.duration_s, 8), {1, 3, 8});
  each("motor-time", "motor_time", over(Shape::kCosines, Covariate::kMotorTimeSum, 0, extent.sum_s, 8), {1, 3, 8});
  each("position", "position", plane(extent, 3), {2, 5, 9});
  each("heading", "heading", over(Shape::kHarmonics, Covariate::kHeading, 0, 1, 2), {2, 4});
  Factor since = over(Shape::kCosines, Covariate::kSinceCommand, 0, extent.since_s, 4);
  since.warp = 1;
  each("time-since-command", "time_since_command", since, {1, 4});
}

}  // namespace kilotwin::identify
