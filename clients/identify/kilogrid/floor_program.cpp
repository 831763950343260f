#include "clients/identify/kilogrid/floor_program.hpp"

#include <cmath>

#include "core/math/elementary.h"

namespace kilotwin::kilogrid {

std::uint64_t Dice::bits() {
  state_ += 0x9e3779b97f4a7c15u;
  std::uint64_t z = state_;
  z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
  z = (z ^ z >> 27) * 0x94d049bb133111ebu;
  return z ^ z >> 31;
}

double Dice::uniform() { return (static_cast<double>(bits() >> 12) + 0.5) * 0x1p-52; }

double Dice::normal() { return kt_inverse_normal(uniform()); }

std::int64_t FloorProgram::draw(double mean_s, double sd_s) {
  return static_cast<std::int64_t>(std::abs(std::trunc(mean_s + sd_s * dice_.normal()))) * kWalkTicks;
}

void FloorProgram::forget_readings() {
  readings_ = 0;
  sum_ = reading_ = previous_ = 0;
}

void FloorProgram::hear_wall(std::int64_t now, double strength) {
  avoiding_ = wall_near_ = true;
  wall_until_ = now + kWallTicks;
  sum_ += strength;
  if (++readings_ < kReadings) return;
  previous_ = reading_;
  reading_ = sum_;
  readings_ = 0;
  sum_ = 0;
  new_reading_ = true;
}

Motion FloorProgram::loop(std::int64_t now) {
  avoiding_ ? avoid(now) : walk(now);
  return motion_;
}

void FloorProgram::walk(std::int64_t now) {
  switch (walk_) {
    case Walk::kBegin:
      walk_until_ = now + draw(times_.straight_mean_s, times_.straight_sd_s);
      motion_ = Motion::kStraight;
      walk_ = Walk::kStraight;
      break;
    case Walk::kStraight:
      if (now <= walk_until_) break;
      walk_until_ = now + draw(times_.turn_mean_s, times_.turn_sd_s);
      motion_ = dice_.uniform() > 0.5 ? Motion::kLeft : Motion::kRight;
      walk_ = Walk::kTurn;
      break;
    case Walk::kTurn:
      if (now > walk_until_) walk_ = Walk::kBegin;
      break;
  }
}

void FloorProgram::avoid(std::int64_t now) {
  if (now > wall_until_) {
    wall_near_ = false;
    avoid_ = Avoid::kBegin;
  }
  if (!wall_near_) {
    avoiding_ = false;
    return;
  }
  const std::int64_t longest_turn = 7500 / kWallTicks;
  switch (avoid_) {
    case Avoid::kBegin:
      motion_ = dice_.uniform() > 0.5 ? Motion::kLeft : Motion::kRight;
      forget_readings();
      turn_until_ = now + longest_turn;
      avoid_ = Avoid::kTurn;
      break;
    case Avoid::kTurn:
      if (now > turn_until_) {
        turn_until_ = now + longest_turn;
        motion_ = motion_ == Motion::kLeft ? Motion::kRight : Motion::kLeft;
        forget_readings();
      }
      if (!new_reading_) break;
      new_reading_ = false;
      if (previous_ > reading_) {
        motion_ = Motion::kStraight;
        avoid_ = Avoid::kEscape;
      }
      break;
    case Avoid::kEscape:
      if (!new_reading_) break;
      new_reading_ = false;
      if (previous_ < reading_) avoid_ = Avoid::kBegin;
      break;
  }
}

}  // namespace kilotwin::kilogrid
