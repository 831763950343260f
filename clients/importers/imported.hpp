/// Experiments of other simulators, as experiments of Kilotwin.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "idl/experiment.pb.h"

namespace kilotwin::importers {

/// Least distance of the centre of an imported robot from a wall.
inline constexpr double kFromWall_mm = 17;

/// A table of initial poses that the experiment names.
struct PosesFile {
  std::string name;  ///< beside the experiment file
  std::string text;  ///< CSV: x_mm,y_mm,heading_deg
};

struct Imported {
  proto::Experiment experiment;
  std::vector<PosesFile> poses;
  /// Settings that were not taken over as they are, each with its line: "12: <floor>: ...". In the order of the file.
  std::vector<std::string> notes;
};

/// An .argos file of ARGoS' Kilobot plugin. `name`: the file, for errors. Throws UserError with the line of a syntax error, or if
/// there is no robot.
[[nodiscard]] Imported from_argos(std::string_view text, const std::string& name);

/// Parameters of Kilombo, a JSON object. `name` as above. Throws UserError.
[[nodiscard]] Imported from_kilombo(std::string_view text, const std::string& name);

/// The content of a file that a configuration names; nothing where it cannot be read.
using ReadNamed = std::function<std::optional<std::string>(const std::string& file)>;

/// A configuration of pogosim, in YAML. `name` as above. `read`: for the table of initial poses, if it names one. Throws UserError with
/// the line, or if no object is a pogobot.
[[nodiscard]] Imported from_pogosim(std::string_view text, const std::string& name, const ReadNamed& read = {});

/// The experiment file: the notes as comments, then the fields.
[[nodiscard]] std::string experiment_text(const Imported& imported, const std::string& source);

}  // namespace kilotwin::importers
