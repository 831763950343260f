// Tables of pogosim. docs/how-to/from-pogosim.md lists what becomes of their columns.
#include "clients/importers/pogosim_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "clients/importers/arrow_file.hpp"
#include "core/base/error.hpp"
#include "core/base/pose.hpp"
#include "core/base/say.hpp"
#include "core/csv/csv_reader.hpp"
#include "core/os/files.hpp"

namespace kilotwin::importers {
namespace {

constexpr double kMostRobots = 1e6;

struct Row {
  double time_s = 0;
  std::string category;
  std::uint32_t id = 0;
  double x_mm = 0, y_mm = 0;  ///< from the corner; NaN: unknown
  double heading_rad = 0;     ///< NaN: unknown
};

struct Rows {
  std::vector<Row> rows;
  std::vector<std::string> other_columns;  ///< that are not read
  std::optional<double> width_mm, height_mm;
  bool headings = false;
};

const std::initializer_list<std::string_view> kNeeded{"time", "robot_category", "robot_id", "x", "y"};
constexpr const char* kExpected =
    "the columns time, robot_category, robot_id, x, y and maybe angle, as pogosim and kilotwin export --pogosim "
    "write "
    "them";

bool is_read(const std::string& column) {
  return column == "angle" || std::find(kNeeded.begin(), kNeeded.end(), column) != kNeeded.end();
}

std::optional<double> size_of(const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  return end != text.c_str() && *end == '\0' && value > 2 * kFromWall_mm && value < 1e9 ? std::optional(value)
                                                                                        : std::nullopt;
}

Rows read_csv(const std::filesystem::path& file) {
  CsvReader csv(file);
  csv.require(kNeeded, kExpected);
  Rows out;
  for (const std::string& column : csv.columns()) {
    if (!is_read(column)) out.other_columns.push_back(column);
  }
  const auto angle = csv.find_column("angle");
  out.headings = angle.has_value();
  const std::size_t time = csv.column("time"), category = csv.column("robot_category"), id = csv.column("robot_id"),
                    x = csv.column("x"), y = csv.column("y");
  while (csv.next())
    out.rows.push_back({csv.number(time), std::string(csv.text(category)), csv.whole(id), csv.number_or_nan(x),
                        csv.number_or_nan(y), angle ? csv.number_or_nan(*angle) : std::nan("")});
  // kilotwin export writes the metadata beside the table.
  if (const auto text = os::read_if_there(file.string() + ".json")) {
    const auto about = nlohmann::json::parse(*text, nullptr, false);
    const auto size = [&](const char* name) {
      return about.is_object() && about.contains(name) && about[name].is_string()
                 ? size_of(about[name].get<std::string>())
                 : std::nullopt;
    };
    out.width_mm = size("arena_width_mm");
    out.height_mm = size("arena_height_mm");
  }
  return out;
}

Rows read_feather(const std::filesystem::path& file) {
  const ArrowFile arrow = read_arrow(file);
  std::string names;
  Rows out;
  for (const auto& [name, column] : arrow.columns) {
    names += (names.empty() ? "" : ", ") + name;
    if (!is_read(name)) out.other_columns.push_back(name);
  }
  const auto column = [&](const std::string& name) -> const ArrowColumn& {
    const auto found = arrow.columns.find(name);
    if (found == arrow.columns.end() || found->second.is_text != (name == "robot_category"))
      throw UserError(fmt::format("{}: has no column {} of {}; expected {}; there are {}", one_line(file.string()),
                                  name, name == "robot_category" ? "texts" : "numbers", kExpected,
                                  one_line(names)));
    return found->second;
  };
  const ArrowColumn &time = column("time"), &category = column("robot_category"), &id = column("robot_id"),
                    &x = column("x"), &y = column("y");
  out.headings = arrow.columns.contains("angle");
  const ArrowColumn* const angle = out.headings ? &column("angle") : nullptr;
  for (std::size_t row = 0; row < arrow.rows; ++row) {
    const double number = id.numbers[row];
    if (!(number >= 0 && number <= std::numeric_limits<std::uint32_t>::max()) || !std::isfinite(time.numbers[row]))
      throw UserError(
          fmt::format("{}: row {}: expected a time and a robot_id from 0", one_line(file.string()), row + 1));
    out.rows.push_back({time.numbers[row], category.texts[row], static_cast<std::uint32_t>(number), x.numbers[row],
                        y.numbers[row], angle != nullptr ? angle->numbers[row] : std::nan("")});
  }
  const auto size = [&](const char* name) {
    const auto found = arrow.metadata.find(name);
    return found == arrow.metadata.end() ? std::nullopt : size_of(found->second);
  };
  out.width_mm = size("arena_width_mm");
  out.height_mm = size("arena_height_mm");
  return out;
}

class TableImport {
 public:
  TableImport(const std::filesystem::path& file, Rows rows)
      : name_(one_line(file.string())), run_(file.stem().string()), table_(std::move(rows)) {}

  ImportedTable result() {
    const auto gone = std::erase_if(
        table_.rows, [](const Row& row) { return !std::isfinite(row.x_mm) || !std::isfinite(row.y_mm); });
    if (table_.rows.empty()) throw UserError(name_ + ": holds no position of a robot");
    std::stable_sort(table_.rows.begin(), table_.rows.end(),
                     [](const Row& a, const Row& b) { return a.time_s < b.time_s; });
    number_robots();
    place_arena();
    ImportedTable out;
    write_experiment(out.imported);
    out.tracks = tracks();
    add_notes(out.imported, gone);
    return out;
  }

 private:
  struct Robot {
    const Row* first = nullptr;
    std::uint32_t number = 0;  ///< in the experiment and the tracks
  };

  /// Groups in the order in which their categories come, robots of a group by their ids.
  void number_robots() {
    for (const Row& row : table_.rows) {
      auto group =
          std::find_if(groups_.begin(), groups_.end(), [&](const auto& g) { return g.first == row.category; });
      if (group == groups_.end()) group = groups_.insert(group, {row.category, {}});
      group->second.try_emplace(row.id, Robot{&row});
    }
    std::uint32_t number = 0;
    for (auto& [category, robots] : groups_) {
      for (auto& [id, robot] : robots) {
        renumbered_ = renumbered_ || id != number;
        robot.number = number++;
      }
    }
    robots_ = number;
    if (robots_ > kMostRobots) throw UserError(fmt::format("{}: has more than {:g} robots", name_, kMostRobots));
  }

  void place_arena() {
    double most_x = 0, most_y = 0;
    for (const Row& row : table_.rows) {
      if (row.x_mm < 0 || row.y_mm < 0)
        throw UserError(fmt::format(
            "{}: has a robot at {:g}, {:g} mm; the origin of pogosim's tables is a corner of the arena, "
            "so move the origin until no coordinate is negative",
            name_, row.x_mm, row.y_mm));
      most_x = std::max(most_x, row.x_mm);
      most_y = std::max(most_y, row.y_mm);
    }
    // At least a body wide, so that a robot has a place.
    constexpr double kLeast_mm = 2 * kFromWall_mm + 1;
    width_mm_ = std::max(table_.width_mm.value_or(std::ceil(most_x + kFromWall_mm)), kLeast_mm);
    height_mm_ = std::max(table_.height_mm.value_or(std::ceil(most_y + kFromWall_mm)), kLeast_mm);
  }
  [[nodiscard]] double x_mm(const Row& row) const { return row.x_mm - width_mm_ / 2; }
  [[nodiscard]] double y_mm(const Row& row) const { return row.y_mm - height_mm_ / 2; }

  void write_experiment(Imported& imported) const {
    proto::Experiment& experiment = imported.experiment;
    experiment.set_name(run_);
    experiment.set_duration_s(std::ceil(std::max(1.0, table_.rows.back().time_s)));
    experiment.mutable_arena()->set_width_mm(width_mm_);
    experiment.mutable_arena()->set_height_mm(height_mm_);
    const auto within = [](double at_mm, double size_mm) {
      return std::clamp(at_mm, -size_mm / 2 + kFromWall_mm, size_mm / 2 - kFromWall_mm);
    };
    for (const auto& [category, robots] : groups_) {
      proto::RobotGroup& group = *experiment.add_robots();
      group.set_count(static_cast<std::uint32_t>(robots.size()));
      group.add_behaviour("behaviour.c");
      PosesFile& poses = imported.poses.emplace_back();
      poses.name = fmt::format("{}-poses-{}.csv", run_, imported.poses.size());
      poses.text = "x_mm,y_mm,heading_deg\n";
      group.mutable_layout()->mutable_poses()->set_csv(poses.name);
      for (const auto& [id, robot] : robots) {
        const double heading_rad = std::isfinite(robot.first->heading_rad) ? robot.first->heading_rad : 0;
        fmt::format_to(std::back_inserter(poses.text), "{:.10g},{:.10g},{:.6g}\n",
                       within(x_mm(*robot.first), width_mm_), within(y_mm(*robot.first), height_mm_),
                       heading_rad * 180 / kPi);
      }
    }
  }

  [[nodiscard]] std::string tracks() const {
    std::string text =
        table_.headings ? "run,robot,time_s,x_mm,y_mm,heading_rad\n" : "run,robot,time_s,x_mm,y_mm\n";
    std::map<std::string_view, const std::map<std::uint32_t, Robot>*> group_of;
    for (const auto& [category, robots] : groups_) group_of[category] = &robots;
    for (const Row& row : table_.rows) {
      fmt::format_to(std::back_inserter(text), "{},{},{:.10g},{:.10g},{:.10g}", run_,
                     group_of.at(row.category)->at(row.id).number, row.time_s, x_mm(row), y_mm(row));
      if (table_.headings && std::isfinite(row.heading_rad))
        fmt::format_to(std::back_inserter(text), ",{:.6f}", wrapped(std::remainder(row.heading_rad, 2 * kPi)));
      else if (table_.headings)
        text += ',';
      text += '\n';
    }
    return text;
  }

  void add_notes(Imported& imported, std::size_t gone) const {
    const auto note = [&](std::string text) { imported.notes.push_back(std::move(text)); };
    if (table_.width_mm && table_.height_mm)
      note(
          fmt::format("arena: {:g} by {:g} mm, by the table's metadata; of another shape, this is its bounding box",
                      width_mm_, height_mm_));
    else
      note(
          fmt::format("arena: not in the table; {:g} by {:g} mm hold all positions: give the right size, and move "
                      "poses and tracks by half the difference",
                      width_mm_, height_mm_));
    for (const auto& [category, robots] : groups_)
      note(fmt::format("robot_category {}: {} robots, with the poses of their first rows", one_line(category),
                       robots.size()));
    if (renumbered_)
      note(fmt::format(
          "robot_id: not 0 to {} in the order of the categories; tracks and experiment have new numbers, "
          "by category and robot_id",
          robots_ - 1));
    if (!table_.headings) note("angle: the table has none; robots begin with 0");
    std::string others;
    for (const std::string& column : table_.other_columns)
      others += (others.empty() ? "" : ", ") + one_line(column);
    if (!others.empty()) note(fmt::format("{}: not taken over", others));
    if (gone > 0) note(fmt::format("{} rows have no position; left out", gone));
    note(
        "commands: the table has none; put a commands.csv beside the tracks, or identify assumes that all go "
        "straight");
    note(
        "the program is not in the table; it is taken to be behaviour.c, in C for kilolib, unless --behaviour "
        "names it");
  }

  const std::string name_, run_;
  Rows table_;
  std::vector<std::pair<std::string, std::map<std::uint32_t, Robot>>> groups_;
  std::uint32_t robots_ = 0;
  bool renumbered_ = false;
  double width_mm_ = 0, height_mm_ = 0;
};

}  // namespace

ImportedTable from_pogosim_table(const std::filesystem::path& file) {
  const std::string ending = file.extension().string();
  const bool arrow = ending == ".feather" || ending == ".arrow";
  return TableImport(file, arrow ? read_feather(file) : read_csv(file)).result();
}

}  // namespace kilotwin::importers
