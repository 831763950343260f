/// The description of a run for viewers, as JSON: its arena and bodies, its groups, and how frames are coded. Text in it may come
/// from anywhere: it is valid UTF-8 and escaped, and the page shows it as text only.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "clients/view/frame_code.hpp"

namespace kilotwin {
namespace proto {
class Experiment;
class FloorRecord;
}  // namespace proto

namespace view {

struct RunOutline {
  bool live = false;
  std::string name;
  std::uint64_t run = 0, seed = 0;
  double tick_s = 0;
  std::int64_t first_tick = 0, last_tick = 0;
  std::uint32_t robots = 0;
  std::size_t states = 0;      ///< of a recording
  bool federated = false;      ///< the arena is divided into the partitions of the experiment
  double ghost_margin_mm = 0;  ///< of its partitions
  std::vector<bool> firmware;  ///< per group: runs on the simulated processor; may be shorter
};

/// A message of type "run". Throws std::invalid_argument if a shape of the experiment is invalid.
[[nodiscard]] std::string run_text(const RunOutline&, const proto::Experiment&);
/// The grid of the frames of a run in this arena. Throws as run_text().
[[nodiscard]] PositionGrid grid_of(const proto::Experiment&);
/// A message of type "floors": what virtual environments paint.
[[nodiscard]] std::string floors_text(const std::vector<proto::FloorRecord>&);
/// A message of type "trail": where a robot was, oldest first, x and y in turn; not finite: it was placed elsewhere in between. `whole`: false:
/// there is more, if it is asked for again.
[[nodiscard]] std::string trail_text(std::uint32_t robot, const std::vector<double>& xy_mm, bool whole);
/// Variables of a robot's program, and its printed lines up to a tick.
struct ProgramText {
  std::uint32_t robot = 0;
  std::int64_t tick = 0;
  bool known = true;  ///< false: the run's recording is not at hand
  std::vector<std::pair<std::string, std::optional<double>>> variables;  ///< recorded ones; nothing: no value yet
  std::string log;
};
/// A message of type "program".
[[nodiscard]] std::string program_text(const ProgramText&);
/// An input of a recorded run that is marked on the time line.
struct Mark {
  std::int64_t tick = 0;
  std::string text;  ///< one line
};
/// A message of type "marks". `whole`: false: there are more, if it is asked for again.
[[nodiscard]] std::string marks_text(const std::vector<Mark>& marks, bool whole);
/// A message of type "notice": one line for whoever looks.
[[nodiscard]] std::string notice_text(const std::string& line);
/// The same, of a request to steer that the run refuses. `places`: the request was to place a body elsewhere.
[[nodiscard]] std::string refusal_text(const std::string& line, bool places);

}  // namespace view
}  // namespace kilotwin
