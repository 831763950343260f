#include "services/comm/link_budget.hpp"

#include <algorithm>
#include <bit>
#include <limits>

#include "core/math/elementary.h"
#include "core/plan/radio_settings.hpp"

namespace kilotwin::comm {
namespace {

/// Standard deviation of the sum of four octets: sqrt(4 (256^2 - 1) / 12).
constexpr double kOctetSum_sd = 147.801, kOctetSum_mean = 510;
/// Size of the cache of pair offsets, octets: small enough for the processor's cache.
constexpr std::size_t kRemembered = 8u << 20;
constexpr std::uint32_t kNobody = 0xffffffffu;
/// ln 10 / 10: from dB to the exponent of a power ratio.
constexpr double kPerDecibel = 0.2302585092994046;

}  // namespace

LinkBudget::LinkBudget(const RunPlan& plan)
    : robots_(plan),
      random_(plan.seed()),
      is_disc_(plan.radio_settings().model != RadioSettings::Model::kPropagation),
      range_mm_(plan.radio_settings().range_mm),
      range_square_(range_mm_ * range_mm_),
      decay_db_per_mm_(plan.radio_settings().propagation.decay_db_per_mm),
      mm_per_db_(1 / decay_db_per_mm_),
      reach_mm_(range_mm_),
      certain_square_(range_square_) {
  for (std::uint32_t i = 0; plan.any_cells() && i < plan.robots(); ++i)
    cell_half_mm_.push_back(plan.cell_side_mm(i) / 2);
  if (is_disc_) return;
  const PropagationSettings& model = plan.radio_settings().propagation;
  body_loss_db_ = model.body_loss_db;
  link_sd_db_ = model.link_sd_db;
  pair_sd_db_ = model.pair_sd_db;
  run_sd_db_ = model.run_sd_db;
  packet_sd_db_ = model.packet_sd_db;
  capture_db_ = model.capture_db;
  reading_sd_db_ = model.reading_sd_db;
  notice_db_ = model.notice_db;
  const auto take = [](const std::vector<double>& entries, Pattern& pattern) {
    for (std::size_t i = 0; i + 1 < entries.size(); i += 2)
      pattern.harmonics.push_back({entries[i], entries[i + 1]});
  };
  take(model.power_pattern_db, power_pattern_);
  take(model.sensitivity_pattern_db, sensitivity_pattern_);
  for (const RadioLinkSettings& link : model.links)
    links_.push_back({key(link.sender, link.receiver), link.offset_db});
  std::sort(links_.begin(), links_.end(), [](const Link& a, const Link& b) { return a.key < b.key; });

  const auto points = [](const RadioParameters::Bearing& b) { return b.ahead_db != 0 || b.left_db != 0; };
  sender_matters_ = !power_pattern_.harmonics.empty();
  receiver_matters_ = !sensitivity_pattern_.harmonics.empty();
  for (std::uint32_t i = 0; i < plan.robots(); ++i) {
    sender_matters_ = sender_matters_ || points(robots_.power_bearing(i));
    receiver_matters_ = receiver_matters_ || points(robots_.sensitivity_bearing(i));
    heading_rad_.push_back(plan.initial_pose(i).heading_rad);
  }
  directional_ = sender_matters_ || receiver_matters_;
  if (sender_matters_ && power_pattern_.harmonics.empty()) power_pattern_.harmonics.push_back({0, 0});
  if (receiver_matters_ && sensitivity_pattern_.harmonics.empty()) sensitivity_pattern_.harmonics.push_back({0, 0});
  faced_rad_.assign(plan.robots(), std::numeric_limits<double>::quiet_NaN());
  facing_.assign(plan.robots(), {1, 0});
  if (link_sd_db_ > 0 || pair_sd_db_ > 0 || run_sd_db_ > 0 || !links_.empty()) {
    row_ = static_cast<std::uint32_t>(
        std::clamp<std::size_t>(std::bit_floor(kRemembered / sizeof(Known) / plan.robots()), 16, 256));
    known_.assign(std::size_t{row_} * plan.robots(), {kNobody, 0});
  }
  find_reach();
}

/// Squares are half-open, so that a robot on a border is above one cell.
bool LinkBudget::above_cell(const Neighbourhood& robots, std::uint32_t a, std::uint32_t b) const {
  if (cell_half_mm_[a] > 0 && cell_half_mm_[b] > 0) return false;
  const bool first = cell_half_mm_[a] > 0;
  const std::uint32_t cell = first ? a : b, robot = first ? b : a;
  const double dx = robots.x_mm(robot) - robots.x_mm(cell), dy = robots.y_mm(robot) - robots.y_mm(cell);
  const double half_mm = cell_half_mm_[cell];
  return dx >= -half_mm && dx < half_mm && dy >= -half_mm && dy < half_mm;
}

double LinkBudget::Pattern::amplitude_db() const {
  double sum = 0;
  for (const Vector& v : harmonics) sum += __builtin_sqrt(v.x * v.x + v.y * v.y);
  return sum;
}

/// The largest gain of any pair over the nominal robot bounds the reach. The largest loss bounds the distance within which
/// every robot is heard.
void LinkBudget::find_reach() {
  double power_most = 0, power_least = 0, sensitivity_most = 0, sensitivity_least = 0;
  for (std::uint32_t i = 0; i < heading_rad_.size(); ++i) {
    const auto widen = [](double level, const RadioParameters::Bearing& own, const Pattern& pattern, double& most,
                          double& least) {
      const double amplitude_db =
          __builtin_sqrt(own.ahead_db * own.ahead_db + own.left_db * own.left_db) + pattern.amplitude_db();
      most = std::max(most, level + amplitude_db);
      least = std::min(least, level - amplitude_db);
    };
    widen(robots_.power_db(i), robots_.power_bearing(i), power_pattern_, power_most, power_least);
    widen(robots_.sensitivity_db(i), robots_.sensitivity_bearing(i), sensitivity_pattern_, sensitivity_most,
          sensitivity_least);
  }
  double link_most = max_spread_db(), link_least = -link_most;
  for (const Link& link : links_) {
    link_most = std::max(link_most, link.offset_db + kMostNoise * run_sd_db_);
    link_least = std::min(link_least, link.offset_db - kMostNoise * run_sd_db_);
  }
  reach_mm_ = range_mm_ + (power_most + sensitivity_most + link_most - floor_db()) / decay_db_per_mm_;
  // No disc fits between two discs that touch: a shadow needs a distance of two diameters.
  const double certain_mm = range_mm_ + (power_least + sensitivity_least + link_least) / decay_db_per_mm_;
  const double clear_mm = body_loss_db_ > 0 ? std::min(certain_mm, 3 * kRobotRadius_mm) : certain_mm;
  certain_square_ = clear_mm > 0 ? clear_mm * clear_mm : 0;
}

double LinkBudget::max_spread_db() const {
  return kMostNoise *
         __builtin_sqrt(pair_sd_db_ * pair_sd_db_ + link_sd_db_ * link_sd_db_ + run_sd_db_ * run_sd_db_);
}

double LinkBudget::span_mm() const {
  return casts_shadows() ? __builtin_sqrt(reach_mm_ * reach_mm_ + kRobotRadius_mm * kRobotRadius_mm) : reach_mm_;
}

void LinkBudget::update_facing(std::uint32_t robot) {
  const double heading = heading_rad_[robot];
  if (faced_rad_[robot] == heading) return;
  faced_rad_[robot] = heading;
  facing_[robot] = {kt_cos(heading), kt_sin(heading)};
}

/// Level of a robot towards the unit vector (x, y) of the arena: its own vector plus the pattern that all robots share.
double LinkBudget::bearing_db(const Pattern& pattern, const RadioParameters::Bearing& own, std::uint32_t robot,
                              double x, double y) {
  update_facing(robot);
  const Vector f = facing_[robot];
  const double cosine = f.x * x + f.y * y, sine = f.x * y - f.y * x;
  double sum = own.ahead_db * cosine + own.left_db * sine;
  double c = 1, s = 0;
  for (const Vector& harmonic : pattern.harmonics) {
    const double next = c * cosine - s * sine;
    s = s * cosine + c * sine;
    c = next;
    sum += harmonic.x * c + harmonic.y * s;
  }
  return sum;
}

double LinkBudget::margin_db(const Neighbourhood& robots, std::uint32_t sender, std::uint32_t receiver) {
  const double distance_mm = __builtin_sqrt(robots.square(sender, receiver));
  double margin = decay_db_per_mm_ * (range_mm_ - distance_mm);
  margin += robots_.power_db(sender) + robots_.sensitivity_db(receiver);
  if (directional_ && distance_mm > 0) {
    const double x = (robots.x_mm(receiver) - robots.x_mm(sender)) / distance_mm;
    const double y = (robots.y_mm(receiver) - robots.y_mm(sender)) / distance_mm;
    if (sender_matters_) margin += bearing_db(power_pattern_, robots_.power_bearing(sender), sender, x, y);
    if (receiver_matters_)
      margin += bearing_db(sensitivity_pattern_, robots_.sensitivity_bearing(receiver), receiver, -x, -y);
  }
  if (row_ > 0) margin += static_cast<double>(spread_db(sender, receiver));
  if (body_loss_db_ > 0) margin -= body_loss_db_ * robots.bodies_between(sender, receiver, kRobotRadius_mm);
  return margin;
}

/// Random offset of a pair, constant within the run.
float LinkBudget::spread_db(std::uint32_t sender, std::uint32_t receiver) {
  Known& known = known_[std::size_t{receiver} * row_ + (sender & (row_ - 1))];
  if (known.other != sender) known = {sender, drawn_spread_db(sender, receiver)};
  return known.db;
}

float LinkBudget::drawn_spread_db(std::uint32_t sender, std::uint32_t receiver) const {
  const std::uint32_t low = std::min(sender, receiver), high = std::max(sender, receiver);
  const std::uint32_t direction = sender < receiver ? 1 : 2;
  double sum = 0;
  const std::uint64_t wanted = key(sender, receiver);
  const auto link = std::lower_bound(links_.begin(), links_.end(), wanted,
                                     [](const Link& a, std::uint64_t k) { return a.key < k; });
  const bool known = link != links_.end() && link->key == wanted;
  if (known) {
    sum += link->offset_db;
  } else if (link_sd_db_ > 0 || pair_sd_db_ > 0) {
    const auto word = random_.block(Stream::kLink, low, Tick{high}, 0);
    sum += pair_sd_db_ * noise(word[0]) + link_sd_db_ * noise(word[direction]);
  }
  if (run_sd_db_ > 0) sum += run_sd_db_ * noise(random_.block(Stream::kLink, low, Tick{high}, 1)[direction]);
  if (!known) sum = std::clamp(sum, -max_spread_db(), max_spread_db());
  return static_cast<float>(sum);
}

double LinkBudget::packet_noise_db(std::uint32_t sender, std::uint32_t receiver, std::int64_t instant) const {
  if (!(packet_sd_db_ > 0)) return 0;
  // The sender selects the block of the draw: a robot and an instant have 2^16 blocks.
  return packet_sd_db_ * noise(random_.block(Stream::kPacket, receiver, Tick{instant}, sender & 0xffffu)[0]);
}

Gains LinkBudget::readings(std::uint32_t sender, std::uint32_t receiver, std::int64_t instant,
                           double margin_db) const {
  const Gains exact = gains(margin_db);
  if (!(reading_sd_db_ > 0)) return exact;
  const auto word = random_.block(Stream::kPacket, receiver, Tick{instant}, sender & 0xffffu);
  const auto noisy = [this](std::int16_t reading, std::uint32_t bits) {
    const double counts = reading * kt_exp(kPerDecibel * reading_sd_db_ * noise(bits));
    return static_cast<std::int16_t>(std::min(counts + 0.5, 1023.0));
  };
  return {noisy(exact.high, word[1]), noisy(exact.low, word[2])};
}

double LinkBudget::noise(std::uint32_t bits) {
  const std::uint32_t sum = (bits & 0xff) + (bits >> 8 & 0xff) + (bits >> 16 & 0xff) + (bits >> 24);
  return (static_cast<double>(sum) - kOctetSum_mean) * (1 / kOctetSum_sd);
}

}  // namespace kilotwin::comm
