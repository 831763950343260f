// Which constants of a contact law decide how a crowd of Kilobots diffuses? Simulates the crowd of experiments/diffusion.txtpb
// under the contact law of ARGoS' Kilobot plugin (dynamics2d): rigid discs in a Chipmunk space, each pulled towards its drive's
// velocity with a bounded force and torque. Every constant can be set.
// Usage: crowd [NAME=VALUE]...     names and defaults: the table below. Prints the mean square displacement of the crowd.
#include <chipmunk/chipmunk.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <random>
#include <string>
#include <vector>

namespace {

std::map<std::string, double> constants = {
    {"seeds", 20},           //
    {"friction", 2.5},       // per disc; the solver multiplies those of a pair
    {"max_force_N", 0.001},  // largest force that pulls a robot towards its drive's velocity
    {"max_torque_Nm", 0.001},
    {"mass_kg", 0.010},
    {"bias_sd_mm_s", 1.86},
    {"bias_mean_mm_s", 0.015},
    {"steps_per_tick", 10},  // physics steps, and solver iterations per step
};

constexpr double kPi = 3.14159265358979323846, kTicksPerSecond = 31, kRadius_m = 0.0165, kAxleOffset_m = 0.0092,
                 kWheelBase_m = 0.025, kStraight_m_s = 0.010, kTurn_m_s = 0.020;
constexpr int kStraightTicks = 310, kLongestTurnTicks = 123, kSeconds = 180;
constexpr int kRingCount[] = {5, 10, 15, 20};
constexpr double kRingRadius_m[] = {0.035, 0.070, 0.105, 0.140};

struct Robot {
  cpBody* body;   // its origin lies between the rear legs
  cpBody* drive;  // of infinite mass, with the velocity of the wheels
  double bias_left_m_s, bias_right_m_s, start_x_m, start_y_m;
  enum { kStraight, kLeft, kRight } leg = kStraight;
  int leg_ends_at = kStraightTicks;
};

cpVect centre(const Robot& robot) { return cpBodyLocalToWorld(robot.body, cpv(kAxleOffset_m, 0)); }

Robot place(cpSpace* space, double x_m, double y_m, double heading_rad) {
  const double mass = constants["mass_kg"];
  Robot robot{};
  robot.body =
      cpSpaceAddBody(space, cpBodyNew(mass, cpMomentForCircle(mass, 0, 2 * kRadius_m, cpv(kAxleOffset_m, 0))));
  cpBodySetPosition(robot.body,
                    cpv(x_m - kAxleOffset_m * std::cos(heading_rad), y_m - kAxleOffset_m * std::sin(heading_rad)));
  cpBodySetAngle(robot.body, heading_rad);
  cpShape* const disc = cpSpaceAddShape(space, cpCircleShapeNew(robot.body, kRadius_m, cpv(kAxleOffset_m, 0)));
  cpShapeSetFriction(disc, constants["friction"]);
  robot.drive = cpBodyNewKinematic();
  cpConstraint* const pull =
      cpSpaceAddConstraint(space, cpPivotJointNew2(robot.body, robot.drive, cpvzero, cpvzero));
  cpConstraintSetMaxBias(pull, 0);
  cpConstraintSetMaxForce(pull, constants["max_force_N"]);
  cpConstraint* const turn = cpSpaceAddConstraint(space, cpGearJointNew(robot.body, robot.drive, 0, 1));
  cpConstraintSetMaxBias(turn, 0);
  cpConstraintSetMaxForce(turn, constants["max_torque_Nm"]);
  robot.start_x_m = x_m;
  robot.start_y_m = y_m;
  return robot;
}

void drive(Robot& robot, int tick, std::mt19937_64& generator) {
  while (tick >= robot.leg_ends_at) {
    if (robot.leg == Robot::kStraight) {
      robot.leg = (generator() & 1) != 0 ? Robot::kLeft : Robot::kRight;
      robot.leg_ends_at = tick + static_cast<int>(generator() % (kLongestTurnTicks + 1));
    } else {
      robot.leg = Robot::kStraight;
      robot.leg_ends_at = tick + kStraightTicks;
    }
  }
  const bool straight = robot.leg == Robot::kStraight;
  const double left = (straight ? kStraight_m_s : robot.leg == Robot::kRight ? kTurn_m_s : 0) + robot.bias_left_m_s;
  const double right = (straight                    ? kStraight_m_s
                        : robot.leg == Robot::kLeft ? kTurn_m_s
                                                    : 0) +
                       robot.bias_right_m_s;
  const double speed = 0.5 * (left + right), angle = cpBodyGetAngle(robot.body);
  cpBodySetVelocity(robot.drive, cpv(speed * std::cos(angle), speed * std::sin(angle)));
  cpBodySetAngularVelocity(robot.drive, (right - left) / kWheelBase_m);
}

/// Adds the crowd's mean square displacement, mm^2, every ten seconds.
void run(std::uint64_t seed, std::vector<std::vector<double>>& msd_mm2) {
  std::mt19937_64 generator(7919 * seed);
  std::normal_distribution<double> bias(constants["bias_mean_mm_s"], constants["bias_sd_mm_s"]);
  const int steps = static_cast<int>(constants["steps_per_tick"]);
  cpSpace* const space = cpSpaceNew();
  cpSpaceSetIterations(space, steps);
  std::vector<Robot> robots;
  for (int ring = 0; ring < 4; ++ring) {
    for (int i = 0; i < kRingCount[ring]; ++i) {
      const double angle = 2 * kPi * i / kRingCount[ring];
      robots.push_back(
          place(space, kRingRadius_m[ring] * std::cos(angle), kRingRadius_m[ring] * std::sin(angle), angle + kPi));
      robots.back().bias_left_m_s = 1e-3 * bias(generator);
      robots.back().bias_right_m_s = 1e-3 * bias(generator);
    }
  }
  for (int tick = 0; tick < kSeconds * kTicksPerSecond; ++tick) {
    for (Robot& robot : robots) drive(robot, tick, generator);
    for (int step = 0; step < steps; ++step) cpSpaceStep(space, 1 / kTicksPerSecond / steps);
    if ((tick + 1) % static_cast<int>(10 * kTicksPerSecond) != 0) continue;
    double sum = 0;
    for (const Robot& robot : robots) {
      const cpVect at = centre(robot);
      sum +=
          (at.x - robot.start_x_m) * (at.x - robot.start_x_m) + (at.y - robot.start_y_m) * (at.y - robot.start_y_m);
    }
    msd_mm2[static_cast<std::size_t>((tick + 1) / (10 * kTicksPerSecond)) - 1].push_back(
        1e6 * sum / static_cast<double>(robots.size()));
  }
  // The space is not freed: it lives until the process ends.
}

}  // namespace

int main(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i], name = word.substr(0, word.find('='));
    if (constants.count(name) == 0 || name == word) {
      std::fprintf(stderr, "usage: crowd [NAME=VALUE]...; names:");
      for (const auto& [known, value] : constants) std::fprintf(stderr, " %s=%g", known.c_str(), value);
      std::fprintf(stderr, "\n");
      return 2;
    }
    constants[name] = std::atof(word.c_str() + name.size() + 1);
  }
  std::vector<std::vector<double>> msd_mm2(kSeconds / 10);
  for (int seed = 1; seed <= static_cast<int>(constants["seeds"]); ++seed)
    run(static_cast<std::uint64_t>(seed), msd_mm2);
  std::printf("| time, s | mean square displacement, mm² | standard error, mm² |\n|---|---|---|\n");
  for (std::size_t k = 0; k < msd_mm2.size(); ++k) {
    double mean = 0, squares = 0;
    const auto count = static_cast<double>(msd_mm2[k].size());
    for (const double value : msd_mm2[k]) mean += value / count;
    for (const double value : msd_mm2[k]) squares += (value - mean) * (value - mean);
    std::printf("| %zu | %.0f | %.0f |\n", 10 * (k + 1), mean,
                count > 1 ? std::sqrt(squares / (count - 1) / count) : 0.0);
  }
  return 0;
}
