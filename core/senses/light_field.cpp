#include "core/senses/light_field.hpp"

#include "core/math/elementary.h"
#include "core/plan/motion_settings.hpp"
#include "core/plan/senses_settings.hpp"
#include "core/random/random.hpp"

namespace kilotwin::senses {

LightField::LightField(const RunPlan& plan, Share share)
    : plan_(plan),
      light_(*plan.light_settings()),
      share_(share),
      anchor_z_mm_(light_.sensor.height_mm),
      gain_(share.size()),
      offset_(share.size()) {
  const LightSensorSettings& sensor = light_.sensor;
  double s = 0, c = 0;
  kt_sincos(sensor.angle_deg * (kPi / 180), &s, &c);
  anchor_x_mm_ = sensor.radius_mm * c;
  anchor_y_mm_ = sensor.radius_mm * s;
  double outward = 0, upward = 0;
  kt_sincos(sensor.tilt_deg * (kPi / 180), &outward, &upward);
  axis_ = {outward * c, outward * s, upward};

  const Random random(plan.seed());
  for (std::uint32_t i = 0; i < share.size(); ++i) {
    const auto draw = random.normal_pair(Stream::kLightSensor, share.first + i, Tick{0}, 0);
    gain_[i] = kt_exp(sensor.gain_sd * draw[0]);
    offset_[i] = sensor.offset_sd * draw[1];
  }
  for (const RobotSettings& robot : plan.robot_settings()) {
    if (!share.contains(robot.robot)) continue;
    if (robot.light_gain) gain_[robot.robot - share.first] = *robot.light_gain;
    if (robot.light_offset) offset_[robot.robot - share.first] = *robot.light_offset;
  }

  for (const LightImageSettings& image : light_.images) images_.emplace_back(image);
  if (light_.shadows) shadows_.emplace(sensor.body_height_mm);
}

void LightField::at(const SwarmView& swarm) {
  swarm_ = &swarm;
  if (shadows_) shadows_->prepare(swarm.x_mm, swarm.y_mm);

  const double time_s = plan_.tick_length.seconds_at(swarm.tick);
  lamps_.clear();
  for (const LightSourceSettings& source : light_.sources) {
    const Lamp lamp = lamp_at(source, time_s);
    if (lamp.intensity > 0) lamps_.push_back(lamp);
  }
  for (LightImage& image : images_) image.at(time_s);
}

double LightField::light(double x_mm, double y_mm, double z_mm, std::uint32_t self, const Direction& axis) const {
  const Direction* const facing = light_.sensor.cosine ? &axis : nullptr;
  double sum = light_.ambient;
  for (const Lamp& lamp : lamps_) {
    if (shadows_ && shadows_->hides(lamp, x_mm, y_mm, z_mm, self)) continue;
    sum += reading_of(lamp, x_mm, y_mm, z_mm, facing);
  }
  for (const LightImage& image : images_) sum += image.reading(x_mm, y_mm);
  return sum;
}

double LightField::reading(std::uint32_t id) const {
  double s = 0, c = 0;
  kt_sincos(swarm_->heading_rad[id], &s, &c);
  const double x_mm = swarm_->x_mm[id] + c * anchor_x_mm_ - s * anchor_y_mm_;
  const double y_mm = swarm_->y_mm[id] + s * anchor_x_mm_ + c * anchor_y_mm_;
  const Direction axis{c * axis_.x - s * axis_.y, s * axis_.x + c * axis_.y, axis_.z};
  return gain_[id - share_.first] * light(x_mm, y_mm, anchor_z_mm_, id, axis) + offset_[id - share_.first];
}

double LightField::sd(double reading) const {
  const double floor = light_.sensor.noise_floor, relative = light_.sensor.noise_relative * reading;
  return __builtin_sqrt(floor * floor + relative * relative);
}

}  // namespace kilotwin::senses
