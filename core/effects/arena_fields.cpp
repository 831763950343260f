#include "core/effects/arena_fields.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/base/error.hpp"
#include "core/base/state_hash.hpp"
#include "core/math/elementary.h"
#include "idl/checkpoint.pb.h"

namespace kilotwin {

using Counts = ArenaFieldSettings::Counts;

namespace {

/// A trail's cell has two entries: the two robots that passed last.
std::size_t entries_of(Counts counts) { return counts == Counts::kTrail ? 2 : 1; }

/// Lowest corner of a cell along an axis, at or before the arena's side `low_mm`.
double first_corner_mm(double low_mm, const std::optional<double>& corner_mm, double cell_mm) {
  return corner_mm ? *corner_mm - std::ceil((*corner_mm - low_mm) / cell_mm) * cell_mm : low_mm;
}

std::uint32_t clamped_cell(double cells, std::uint32_t count) {
  if (!(cells >= 1)) return 0;
  return cells < count ? static_cast<std::uint32_t>(cells) : count - 1;
}

}  // namespace

ArenaFields::ArenaFields(const RunPlan& plan, PartitionId partition, double reach_mm)
    : plan_(plan), partition_(partition) {
  const double width_mm = plan.world.arena.stated_width_mm(), height_mm = plan.world.arena.stated_height_mm();
  const Rectangle& rectangle = plan.grid.rectangle(partition);
  for (std::uint32_t i = 0; i < plan.fields().size(); ++i) {
    const ArenaFieldSettings& given = plan.fields()[i];
    Field field{};
    field.counts = given.counts;
    field.cells_per_mm = 1 / given.cell_mm;
    field.x0_mm = first_corner_mm(-width_mm / 2, given.corner_x_mm, given.cell_mm);
    field.y0_mm = first_corner_mm(-height_mm / 2, given.corner_y_mm, given.cell_mm);
    field.forget_ticks = given.forget_s / plan.tick_length.seconds();
    field.columns = static_cast<std::uint32_t>((width_mm / 2 - field.x0_mm) * field.cells_per_mm) + 1;
    field.rows = static_cast<std::uint32_t>((height_mm / 2 - field.y0_mm) * field.cells_per_mm) + 1;
    const auto column = [&](double x_mm) {
      return clamped_cell((x_mm - field.x0_mm) * field.cells_per_mm, field.columns);
    };
    const auto row = [&](double y_mm) {
      return clamped_cell((y_mm - field.y0_mm) * field.cells_per_mm, field.rows);
    };
    field.first_column = column(rectangle.x_min_mm - reach_mm);
    field.first_row = row(rectangle.y_min_mm - reach_mm);
    field.width = column(rectangle.x_max_mm + reach_mm) - field.first_column + 1;
    field.height = row(rectangle.y_max_mm + reach_mm) - field.first_row + 1;
    field.cells.resize(entries_of(field.counts) * field.width * field.height);
    if (field.counts == Counts::kVisits) field.slot = plan.memory.index_of({MemorySlot::Kind::kFieldCell, 0, i});
    fields_.push_back(std::move(field));
  }
}

double ArenaFields::margin_mm(const RunPlan& plan) {
  double widest_mm = 0;
  for (const ArenaFieldSettings& field : plan.fields()) widest_mm = std::max(widest_mm, field.cell_mm);
  return 1.5 * widest_mm;  // exceeds a cell's diagonal
}

std::uint32_t ArenaFields::cell_of(const Field& field, double x_mm, double y_mm) {
  return clamped_cell((y_mm - field.y0_mm) * field.cells_per_mm, field.rows) * field.columns +
         clamped_cell((x_mm - field.x0_mm) * field.cells_per_mm, field.columns);
}

std::int64_t ArenaFields::index_of(const Field& field, std::uint32_t cell) {
  const std::uint32_t column = cell % field.columns - field.first_column,
                      row = cell / field.columns - field.first_row;
  // Unsigned subtraction makes cells before the first one huge, so one comparison suffices.
  if (column >= field.width || row >= field.height) return -1;
  return (std::int64_t{row} * field.width + column) * static_cast<std::int64_t>(entries_of(field.counts));
}

bool ArenaFields::is_own(const Field& field, std::uint32_t cell) const {
  const std::uint32_t column = cell % field.columns, row = cell / field.columns;
  const double x_mm = field.x0_mm + (column + 0.5) / field.cells_per_mm,
               y_mm = field.y0_mm + (row + 0.5) / field.cells_per_mm;
  return plan_.grid.owner(x_mm, y_mm) == partition_;
}

double ArenaFields::faded(const Field& field, const Cell& cell, Tick now) {
  if (!(field.forget_ticks > 0) || cell.tick == now.count()) return cell.value;
  return cell.value * kt_exp(static_cast<double>(cell.tick - now.count()) / field.forget_ticks);
}

double ArenaFields::value(std::uint32_t number, std::uint32_t robot, double x_mm, double y_mm, Tick now) const {
  const Field& field = fields_[number];
  const std::int64_t index = index_of(field, cell_of(field, x_mm, y_mm));
  KILOTWIN_DEMAND(index >= 0);
  const Cell* const cell = &field.cells[static_cast<std::size_t>(index)];
  if (field.counts != Counts::kTrail) return faded(field, *cell, now);
  const Cell& other = cell[cell->value == robot + 1.0 ? 1 : 0];
  return other.value == 0 ? 0 : kt_exp(static_cast<double>(other.tick - now.count()) / field.forget_ticks);
}

void ArenaFields::pass(Cell* cell, std::uint32_t robot, Tick now) {
  const Cell passage{robot + 1.0, now.count()};
  if (cell->value != passage.value) cell[1] = cell[0];
  cell[0] = passage;
}

std::uint64_t ArenaFields::hash_of(std::uint32_t field, std::uint32_t number, const Cell* cell) const {
  std::uint64_t sum = 0;
  for (std::size_t e = 0; e < entries_of(fields_[field].counts); ++e) {
    if (cell[e].value == 0) continue;
    sum += entity_hash(HashDomain::kArenaField, number,
                       {field, hash_bits(cell[e].value), static_cast<std::uint64_t>(cell[e].tick)});
  }
  return sum;
}

void ArenaFields::count(Tick now, const RobotColumns& robots, std::span<double> memory) {
  const std::size_t stride = plan_.memory.size();
  for (std::uint32_t f = 0; f < fields_.size(); ++f) {
    Field& field = fields_[f];
    for (std::size_t i = 0; i < robots.size(); ++i) {
      if (field.counts != Counts::kPresentTime && robots.tracked[i] != 0) continue;
      const bool of_driven = field.counts == Counts::kDrivenTime || field.counts == Counts::kTrail;
      if (of_driven && !robots.duties[i].any()) continue;
      const std::uint32_t number = cell_of(field, robots.x_mm[i], robots.y_mm[i]);
      double amount = plan_.tick_length.seconds();
      if (field.counts == Counts::kVisits) {
        double& last = memory[i * stride + field.slot];
        if (last == number) continue;
        last = number;
        amount = 1;
      }
      const std::int64_t index = index_of(field, number);
      if (index < 0) continue;
      Cell* const cell = &field.cells[static_cast<std::size_t>(index)];
      const bool own = is_own(field, number);
      if (own) hash_ -= hash_of(f, number, cell);
      if (field.counts == Counts::kTrail)
        pass(cell, robots.robot[i], now);
      else
        *cell = {faded(field, *cell, now) + amount, field.forget_ticks > 0 ? now.count() : 0};
      if (own) hash_ += hash_of(f, number, cell);
    }
  }
}

void ArenaFields::save(proto::PhysicsState& state) const {
  for (std::uint32_t f = 0; f < fields_.size(); ++f) {
    const Field& field = fields_[f];
    for (std::size_t entry = 0; entry < field.cells.size(); ++entry) {
      const Cell& cell = field.cells[entry];
      const std::size_t index = entry / entries_of(field.counts);
      const auto row = static_cast<std::uint32_t>(index / field.width),
                 column = static_cast<std::uint32_t>(index % field.width);
      const std::uint32_t number = (row + field.first_row) * field.columns + column + field.first_column;
      if (cell.value == 0 || !is_own(field, number)) continue;
      state.add_field(f);
      state.add_field_cell(number);
      state.add_field_value(cell.value);
      state.add_field_tick(cell.tick);
    }
  }
}

void ArenaFields::load(std::span<const proto::PhysicsState* const> parts) {
  hash_ = 0;
  for (Field& field : fields_) std::fill(field.cells.begin(), field.cells.end(), Cell{});
  for (const proto::PhysicsState* part : parts) {
    const int size = part->field_size();
    if (part->field_cell_size() != size || part->field_value_size() != size || part->field_tick_size() != size)
      throw RunError("checkpoint: physics: columns of fields of unequal length; the file is damaged");
    for (int i = 0; i < size; ++i) {
      const std::uint32_t f = part->field(i), number = part->field_cell(i);
      if (f >= fields_.size() || number / fields_[f].columns >= fields_[f].rows)
        throw RunError("checkpoint: physics: unknown cell of a field");
      const std::int64_t index = index_of(fields_[f], number);
      if (index < 0) continue;
      Cell* const cell = &fields_[f].cells[static_cast<std::size_t>(index)];
      Cell* to = cell;
      if (is_own(fields_[f], number)) hash_ -= hash_of(f, number, cell);
      const Cell entry{part->field_value(i), part->field_tick(i)};
      if (fields_[f].counts == Counts::kTrail) {
        if (!(entry.value >= 1 && entry.value <= plan_.robots() && entry.value == std::floor(entry.value)) ||
            cell[1].value != 0)
          throw RunError("checkpoint: physics: a trail of an unknown robot; the file is damaged");
        // The entries of a cell come in their order.
        if (cell->value != 0) to = cell + 1;
      }
      *to = entry;
      if (is_own(fields_[f], number)) hash_ += hash_of(f, number, cell);
    }
  }
}

}  // namespace kilotwin
