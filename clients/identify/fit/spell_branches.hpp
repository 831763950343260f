/// Branches of a history of spells (model/stalls.hpp) in the interval between two samples: a spell goes on or stays away, or it starts or
/// ends in some part of the interval.
#pragma once

#include <array>
#include <cstdint>

#include "clients/identify/model/stalls.hpp"

namespace kilotwin::identify {

/// The end of a history of spells.
struct SpellState {
  bool in_spell = false;
  double lasted_s = 0;       ///< of the present spell; 0 without one
  std::uint32_t recent = 0;  ///< what happened in the latest 8 intervals, two bits each

  /// Whether two histories were the same of late.
  [[nodiscard]] bool like(const SpellState& other) const {
    return in_spell == other.in_spell && recent == other.recent;
  }
};

/// One thing that may happen in an interval.
struct SpellBranch {
  double share;       ///< of the interval in a spell, 0..1
  double variance_s;  ///< as in TrackFilter::in_spell
  double log_probability;
  SpellState after;
};

/// A start or an end lies in one of these parts of an interval.
inline constexpr std::size_t kSpellParts = 3;

/// A history of no spell is not divided at a squared Mahalanobis distance of the sample below this one.
inline constexpr double kBenignForSpells = 6;

/// A robot is in a spell, or in none, all through an interval of `length_s`.
[[nodiscard]] SpellBranch spell_stays(const Stalls&, const SpellState& before, double length_s);
/// A spell starts or ends, by the part of the interval.
[[nodiscard]] std::array<SpellBranch, kSpellParts> spell_changes(const Stalls&, const SpellState& before,
                                                                 double length_s);
/// A spell starts or ends in an interval whose motion does not show it.
[[nodiscard]] SpellBranch spell_changes_unseen(const Stalls&, const SpellState& before, double length_s);

}  // namespace kilotwin::identify
