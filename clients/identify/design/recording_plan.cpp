#include "clients/identify/design/recording_plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "core/csv/csv_writer.hpp"

namespace kilotwin::identify {
namespace {

Motion motion_at(const std::vector<PlannedCommand>& commands, std::int64_t tick) {
  Motion motion = Motion::kStop;
  for (const PlannedCommand& c : commands)
    if (c.tick <= tick) motion = c.motion;
  return motion;
}

}  // namespace

void overwrite(std::vector<PlannedCommand>& commands, std::int64_t from, std::int64_t to, std::int64_t end,
               Motion motion) {
  const Motion after = motion_at(commands, to);
  std::vector<PlannedCommand> changed;
  const auto add = [&](PlannedCommand command) {
    const Motion before = changed.empty() ? Motion::kStop : changed.back().motion;
    if (command.motion != before && command.tick < end) changed.push_back(command);
  };
  for (const PlannedCommand& c : commands)
    if (c.tick < from) add(c);
  add({from, motion});
  add({to, after});
  for (const PlannedCommand& c : commands)
    if (c.tick > to) add(c);
  commands = std::move(changed);
}

std::string commands_csv(const RecordingPlan& plan, const std::string& run) {
  std::string text = "run,robot,time_s,motion\n";
  for (const PlannedRobot& robot : plan.robots) {
    fmt::format_to(std::back_inserter(text), "{},{},0,stop\n", csv_cell(run), robot.robot);
    for (const PlannedCommand& c : robot.commands)
      fmt::format_to(std::back_inserter(text), "{},{},{:.6f},{}\n", csv_cell(run), robot.robot,
                     static_cast<double>(c.tick) * kPlanTick_s, name_of(c.motion));
  }
  return text;
}

std::string poses_csv(const RecordingPlan& plan) {
  std::string text = "x_mm,y_mm,heading_rad\n";
  for (const PlannedRobot& robot : plan.robots)
    fmt::format_to(std::back_inserter(text), "{:.3f},{:.3f},{:.6f}\n", robot.x_mm, robot.y_mm, robot.heading_rad);
  return text;
}

bool fits_robots(const RecordingPlan& plan) {
  // 4 KiB are for the library and the program itself.
  constexpr std::size_t kMostOctets = 24 * 1024, kOctets = 3;
  std::size_t commands = 0;
  for (const PlannedRobot& robot : plan.robots) commands += robot.commands.size();
  return commands * kOctets <= kMostOctets;
}

std::string program_c(const RecordingPlan& plan) {
  std::string from = "0", steps;
  std::size_t count = 0;
  for (const PlannedRobot& robot : plan.robots) {
    for (const PlannedCommand& c : robot.commands)
      fmt::format_to(std::back_inserter(steps), "{}{{{}, {}}},", count++ % 8 == 0 ? "\n  " : " ",
                     c.tick / kPlanStep, static_cast<int>(c.motion));
    fmt::format_to(std::back_inserter(from), ", {}", count);
  }
  return fmt::format(
      R"(/* Plays a planned recording: kilotwin identify --design. Robot N follows the N-th list of commands; other robots rest. */
#include <avr/pgmspace.h>
#include <kilolib.h>

#define ROBOTS {}
#define STEP_TICKS {}
/* In a simulated run setup() is called in this tick. */
#define SETUP_TICK 2

enum {{ STOP, STRAIGHT, LEFT, RIGHT }};

/* From when a motion holds, in steps of STEP_TICKS. */
typedef struct {{
  uint16_t step;
  uint8_t motion;
}} command_t;

static const command_t commands[] PROGMEM = {{{}
  {{0, STOP}}}};
/* First command of each robot, and the end. */
static const uint32_t first[ROBOTS + 1] PROGMEM = {{{}}};

static uint32_t next, end;
static uint32_t start;

static void drive(uint8_t motion) {{
  if (motion == STOP) {{
    set_motors(0, 0);
    return;
  }}
  spinup_motors();
  set_motors(motion == STRAIGHT ? kilo_straight_left : motion == LEFT ? kilo_turn_left : 0,
             motion == STRAIGHT ? kilo_straight_right : motion == RIGHT ? kilo_turn_right : 0);
}}

static void setup(void) {{
  start = kilo_ticks - SETUP_TICK;
  if (kilo_uid >= ROBOTS) return;
  next = pgm_read_dword(&first[kilo_uid]);
  end = pgm_read_dword(&first[kilo_uid + 1]);
}}

static void loop(void) {{
  if (next == end) return;
  if (kilo_ticks - start < (uint32_t)STEP_TICKS * pgm_read_word(&commands[next].step)) return;
  drive(pgm_read_byte(&commands[next].motion));
  ++next;
}}

int main(void) {{
  kilo_init();
  kilo_start(setup, loop);
  return 0;
}}
)",
      plan.robots.size(), kPlanStep, steps, from);
}

std::string experiment_text(const RecordingPlan& plan, const std::string& name, const std::string& program,
                            const std::string& poses, double every_s) {
  return fmt::format(
      R"(# The planned recording, simulated. kilotwin export RUN --commands and --trajectories give the data of identify.
name: "{}"
duration_s: {:.6f}
seed: 1

arena {{ width_mm: {:g} height_mm: {:g} }}

robots {{
  behaviour: "{}"
  loop_rate: ONCE_PER_TICK
  layout {{ poses {{ csv: "{}" }} }}
}}

# Exact clocks, so that commands.csv holds to the tick. Those of real robots differ by some 0.4 %.
radio {{ oscillator_sd: 0 }}

recording {{ every_s: {:g} event: MOTION }}
)",
      name, plan.duration_s(), plan.arena.width_mm, plan.arena.height_mm, program, poses, every_s);
}

}  // namespace kilotwin::identify
