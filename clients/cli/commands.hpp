/// The commands of `kilotwin`. Each function adds a command with its options to the program's parser. add_X() is in X_command.cpp.
#pragma once

#include <functional>

namespace CLI {
class App;
}

namespace kilotwin::cli {

/// Exit statuses, part of the public interface (docs/reference).
inline constexpr int kDone = 0, kFailed = 1, kBadInput = 2;

struct Command {
  CLI::App* parser = nullptr;  ///< belongs to the program's parser
  std::function<int()> work;   ///< returns the exit status; throws UserError and RunError
};

/// `started_s`: start time of the program, steady clock, s.
[[nodiscard]] Command add_run(CLI::App& program, double started_s);
[[nodiscard]] Command add_check(CLI::App& program);
[[nodiscard]] Command add_arenas(CLI::App& program);
[[nodiscard]] Command add_build(CLI::App& program);
[[nodiscard]] Command add_sweep(CLI::App& program);
[[nodiscard]] Command add_tune(CLI::App& program);
[[nodiscard]] Command add_export(CLI::App& program);
[[nodiscard]] Command add_replay(CLI::App& program);
[[nodiscard]] Command add_import(CLI::App& program);
[[nodiscard]] Command add_identify(CLI::App& program);
[[nodiscard]] Command add_cameras(CLI::App& program);
[[nodiscard]] Command add_track(CLI::App& program);
[[nodiscard]] Command add_movie(CLI::App& program);
[[nodiscard]] Command add_service(CLI::App& program, double started_s);
[[nodiscard]] Command add_ros2(CLI::App& program);
[[nodiscard]] Command add_play(CLI::App& program);
[[nodiscard]] Command add_listen(CLI::App& program);
[[nodiscard]] Command add_control(CLI::App& program);
[[nodiscard]] Command add_config(CLI::App& program);
[[nodiscard]] Command add_ohc(CLI::App& program);
[[nodiscard]] Command add_debug(CLI::App& program);
[[nodiscard]] Command add_doctor(CLI::App& program);

}  // namespace kilotwin::cli
