/// A swarm of robots for tests: programs given as text, hosts, and radio frames that the test writes.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "services/behaviours/compiler.hpp"
#include "services/behaviours/engine.hpp"

namespace kilotwin::behaviours::test {

/// A temporary directory, removed by the destructor.
class Folder {
 public:
  Folder();
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  ~Folder();
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// Writes a file and returns its path.
  std::filesystem::path write(const std::string& name, const std::string& text) const;

 private:
  std::filesystem::path path_;
};

/// Options with a cache that all tests share.
[[nodiscard]] CompileOptions cached();

/// `body` with kilolib.h before it and a main() after it that registers rx, tx, tx_success, setup and loop, all of which
/// `body` may define; those that it leaves out are empty.
[[nodiscard]] std::string program(const std::string& body);

[[nodiscard]] IrMessage message(std::uint8_t type, std::uint8_t first_octet = 0);
inline constexpr std::uint8_t kReset = 0x83, kSleep = 0x84, kWakeup = 0x85, kVoltage = 0x87, kRun = 0x88,
                              kReadUid = 0x89;

/// Main function of a program with setup() and loop().
inline const std::string kMain = "int main() { kilo_init(); kilo_start(setup, loop); return 0; }\n";
/// LED colours of frames.
inline constexpr std::uint8_t kRed = 0x03, kGreen = 0x0C, kBlue = 0x30;

/// Whether one of the lines contains a text.
[[nodiscard]] bool mentions(const std::vector<std::string>& lines, const std::string& text);
/// The path of a program of behaviours/.
[[nodiscard]] std::string ready_made(const std::string& name);

/// The radio's input to all robots in one tick.
struct Air {
  struct Reception {
    std::uint32_t robot;
    IrMessage message;
    std::int16_t high_gain = 400, low_gain = 300;
    std::uint16_t crc_error = 0;
  };
  std::vector<Reception> receptions;  ///< ordered by robot
  std::vector<std::uint32_t> ask, sent;
  std::uint8_t kilo_ticks = 1;

  [[nodiscard]] RadioFrame frame(Tick, const Share&) const;
};

class Swarm {
 public:
  /// `robots` of each program (C text of several lines, or the path of a source), on `hosts` hosts.
  /// `experiment`: more of it, in text format; `edit` has the last word. Robots stand in rows, 40 mm apart, and look to the right.
  Swarm(const std::vector<std::string>& programs, std::uint32_t robots, std::uint32_t hosts = 1,
        const std::string& experiment = "", const std::function<void(proto::Manifest&)>& edit = {});

  /// One tick of all hosts. Throws if a call of loop() changed the state and the program's count of writes says that it did not.
  void step(const Air& air = {});
  /// Delivers RUN to all robots and lets them start.
  void start();
  void steps(int count) {
    for (int i = 0; i < count; ++i) step();
  }

  /// The frames of all hosts at the current tick, joined into one.
  [[nodiscard]] ActuationFrame frame() const;
  [[nodiscard]] std::uint64_t hash() const;
  [[nodiscard]] LifeCycle life_cycle(std::uint32_t robot) const { return LifeCycle{frame().life_cycle[robot]}; }
  [[nodiscard]] std::uint8_t led(std::uint32_t robot) const { return frame().led[robot]; }

  Folder folder;
  std::unique_ptr<RunPlan> plan;
  std::shared_ptr<ProgramSet> programs;
  std::vector<std::unique_ptr<BehavioursEngine>> hosts;
  BodyFrame bodies;  ///< poses of all robots
  Tick tick;
};

/// A simple radio: it requests a message from each robot every 16 ticks. An offered message reaches the next two ids and is sent one
/// tick later.
[[nodiscard]] Air echo(const ActuationFrame& frame);

[[nodiscard]] bool equal(const ActuationFrame& a, const ActuationFrame& b);

/// All robots hear a message.
[[nodiscard]] Air to_all(const Swarm&, const IrMessage&);

}  // namespace kilotwin::behaviours::test
