// Effects in words: what each record depends on, with places and directions.
#include "clients/identify/model/effect_text.hpp"

#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace kilotwin::identify {
namespace {

proto::Effect effect(const std::string& function) {
  proto::Effect out;
  EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString(
      "name: 'speed-by-position' acts_on: WHEEL_GAIN function { " + function + " }", &out));
  return out;
}

TEST(EffectText, ABorderIsAPlaceAlongADirection) {
  const std::vector<proto::Effect> border{effect("of: ALONG along_deg: 37 steps { at: 70 value: [0, -0.4] }")};
  EXPECT_EQ(size_in_words(border), "along 37 degrees from the x axis: −40 % from 70 mm on");
  const auto curves = curves_of("speed-by-position", border);
  ASSERT_EQ(curves.size(), 1U);
  EXPECT_EQ(curves[0].covariate(), "place along a direction");
  EXPECT_EQ(curves[0].unit(), "mm");
}

TEST(EffectText, AMovingDiscNamesItsCentreAndMotion) {
  const std::vector<proto::Effect> disc{
      effect("of: POINT_DISTANCE point { x_mm: -50 y_mm: 60 velocity_x_mm_s: 1.2 growth_mm_s: -0.5 } "
             "steps { at: 80 value: [-0.4, 0] }")};
  EXPECT_EQ(size_in_words(disc),
            "circles about (-50, 60) mm at the start, moving at (1.20, 0.00) mm/s, shrinking by 0.50 mm/s: "
            "−40 % up to 80 mm, +0 % from 80 mm on");
}

}  // namespace
}  // namespace kilotwin::identify
