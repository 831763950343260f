#include "services/comm/link_budget.hpp"

#include <algorithm>
#include <limits>

#include "core/math/elementary.h"

namespace kilotwin::comm {
namespace {

/// 1 / sqrt(8 / 12), over the 2^16 steps of a uniform number.
constexpr double kNoiseStep = 1.224744871391589 / 65536;

}  // namespace

LinkBudget::LinkBudget(const RunPlan& plan)
    : random_(plan.seed()),
      is_disc_(plan.experiment().radio().model() != proto::Radio::PROPAGATION),
      range_mm_(plan.experiment().radio().range_mm()),
      range_square_(range_mm_ * range_mm_),
      decay_db_per_mm_(plan.experiment().radio().propagation().decay_db_per_mm()),
      reach_mm_(range_mm_),
      surely_square_(range_square_) {
  if (is_disc_) return;
  const proto::Propagation& model = plan.experiment().radio().propagation();
  body_loss_db_ = model.body_loss_db();
  link_sd_db_ = model.link_sd_db();
  packet_sd_db_ = model.packet_sd_db();
  capture_db_ = model.capture_db();
  draw_robots(model, plan.robots());
  note_known(model, plan.robots());
  for (std::uint32_t i = 0; i < plan.robots(); ++i) {
    for (const Vector& v : {power_bearing_[i], sensitivity_bearing_[i]})
      directional_ = directional_ || v.x != 0 || v.y != 0;
  }
  if (directional_) {
    for (std::uint32_t i = 0; i < plan.robots(); ++i) heading_rad_.push_back(plan.initial_pose(i).heading_rad);
    oriented_rad_.assign(plan.robots(), std::numeric_limits<double>::quiet_NaN());
    power_in_arena_.resize(plan.robots());
    sensitivity_in_arena_.resize(plan.robots());
  }
  find_reach();
}

void LinkBudget::draw_robots(const proto::Propagation& model, std::uint32_t robots) {
  const auto draw = [&](std::uint32_t robot, std::uint32_t number, double sd) {
    return sd > 0 ? sd * random_.normal(Stream::kLink, robot, Tick{-1}, number) : 0.0;
  };
  for (std::uint32_t i = 0; i < robots; ++i) {
    power_db_.push_back(draw(i, 0, model.power_sd_db()));
    sensitivity_db_.push_back(draw(i, 1, model.sensitivity_sd_db()));
    power_bearing_.push_back({draw(i, 2, model.power_bearing_sd_db()), draw(i, 3, model.power_bearing_sd_db())});
    sensitivity_bearing_.push_back(
        {draw(i, 4, model.sensitivity_bearing_sd_db()), draw(i, 5, model.sensitivity_bearing_sd_db())});
  }
}

void LinkBudget::note_known(const proto::Propagation& model, std::uint32_t robots) {
  for (const proto::RobotRadio& known : model.robot()) {
    const std::uint32_t i = known.robot();
    if (i >= robots) continue;
    if (known.has_power_db()) power_db_[i] = known.power_db();
    if (known.has_sensitivity_db()) sensitivity_db_[i] = known.sensitivity_db();
    if (known.has_power_ahead_db()) power_bearing_[i].x = known.power_ahead_db();
    if (known.has_power_left_db()) power_bearing_[i].y = known.power_left_db();
    if (known.has_sensitivity_ahead_db()) sensitivity_bearing_[i].x = known.sensitivity_ahead_db();
    if (known.has_sensitivity_left_db()) sensitivity_bearing_[i].y = known.sensitivity_left_db();
  }
  for (const proto::RadioLink& link : model.link())
    links_.push_back({key(link.sender(), link.receiver()), link.offset_db()});
  std::sort(links_.begin(), links_.end(), [](const Link& a, const Link& b) { return a.key < b.key; });
}

/// The greatest gain over the nominal robot that any pair can have bounds the reach; the greatest loss, the distance within
/// which everybody is heard.
void LinkBudget::find_reach() {
  double power_most = 0, power_least = 0, sensitivity_most = 0, sensitivity_least = 0;
  for (std::size_t i = 0; i < power_db_.size(); ++i) {
    const auto widen = [](double level, const Vector& v, double& most, double& least) {
      const double swing = __builtin_sqrt(v.x * v.x + v.y * v.y);
      most = std::max(most, level + swing);
      least = std::min(least, level - swing);
    };
    widen(power_db_[i], power_bearing_[i], power_most, power_least);
    widen(sensitivity_db_[i], sensitivity_bearing_[i], sensitivity_most, sensitivity_least);
  }
  double link_most = 0, link_least = 0;
  for (const Link& link : links_) {
    link_most = std::max(link_most, link.offset_db);
    link_least = std::min(link_least, link.offset_db);
  }
  const double noise = kMostNoise * (link_sd_db_ + packet_sd_db_);
  reach_mm_ = range_mm_ + (power_most + sensitivity_most + link_most + noise) / decay_db_per_mm_;
  // Between discs that touch there is no room for another: a shadow needs a distance of two diameters.
  const double surely_mm = range_mm_ + (power_least + sensitivity_least + link_least - noise) / decay_db_per_mm_;
  const double clear_mm = body_loss_db_ > 0 ? std::min(surely_mm, 3 * kRobotRadius_mm) : surely_mm;
  surely_square_ = clear_mm > 0 ? clear_mm * clear_mm : 0;
}

void LinkBudget::orient(std::uint32_t robot) {
  const double heading = heading_rad_[robot];
  if (oriented_rad_[robot] == heading) return;
  oriented_rad_[robot] = heading;
  const double c = kt_cos(heading), s = kt_sin(heading);
  const auto turned = [c, s](const Vector& v) { return Vector{c * v.x - s * v.y, s * v.x + c * v.y}; };
  power_in_arena_[robot] = turned(power_bearing_[robot]);
  sensitivity_in_arena_[robot] = turned(sensitivity_bearing_[robot]);
}

double LinkBudget::margin_db(const Neighbourhood& robots, std::uint32_t sender, std::uint32_t receiver) {
  const double distance_mm = __builtin_sqrt(robots.square(sender, receiver));
  double margin = decay_db_per_mm_ * (range_mm_ - distance_mm);
  margin += power_db_[sender] + sensitivity_db_[receiver];
  if (directional_ && distance_mm > 0) {
    orient(sender);
    orient(receiver);
    const double x = robots.x_mm(receiver) - robots.x_mm(sender), y = robots.y_mm(receiver) - robots.y_mm(sender);
    const Vector &power = power_in_arena_[sender], &sensitivity = sensitivity_in_arena_[receiver];
    margin += (x * (power.x + sensitivity.x) + y * (power.y + sensitivity.y)) / distance_mm;
  }
  if (link_sd_db_ > 0) margin += link_sd_db_ * noise(Stream::kLink, receiver, Tick{sender}, 3);
  if (!links_.empty()) {
    const std::uint64_t wanted = key(sender, receiver);
    const auto link = std::lower_bound(links_.begin(), links_.end(), wanted,
                                       [](const Link& a, std::uint64_t k) { return a.key < k; });
    if (link != links_.end() && link->key == wanted) margin += link->offset_db;
  }
  if (body_loss_db_ > 0) margin -= body_loss_db_ * robots.bodies_between(sender, receiver, kRobotRadius_mm);
  return margin;
}

double LinkBudget::packet_noise_db(std::uint32_t sender, std::uint32_t receiver, Tick now) const {
  if (!(packet_sd_db_ > 0)) return 0;
  // The sender goes into the draw, where the numbers of a robot and tick have room for 2^16 blocks.
  return packet_sd_db_ * noise(Stream::kPacket, receiver, now, sender & 0xffffu);
}

double LinkBudget::noise(Stream stream, std::uint32_t entity, Tick tick, std::uint32_t block) const {
  std::int32_t sum = 0;
  for (const std::uint32_t word : random_.block(stream, entity, tick, block))
    sum += static_cast<std::int32_t>(word & 0xffffu) + static_cast<std::int32_t>(word >> 16);
  // Eight numbers of mean 2^15 - 1/2 each.
  return kNoiseStep * (static_cast<double>(sum) - 8 * 32767.5);
}

}  // namespace kilotwin::comm
