#include "clients/identify/fit/spell_branches.hpp"

#include <algorithm>
#include <cmath>

namespace kilotwin::identify {
namespace {

double stay_probability(const Stalls& stalls, const SpellState& s, double length_s) {
  return s.in_spell ? stalls.survival(s.lasted_s + length_s) / std::max(stalls.survival(s.lasted_s), 1e-300)
                    : std::exp(-length_s / stalls.mean_apart_s);
}

SpellState after(const SpellState& before, bool in_spell, double share, double length_s, std::uint32_t what) {
  // Bits of the latest 8 intervals, two each; with more, fewer histories merge.
  constexpr std::uint32_t kRecent = 0xffff;
  const double lasted_s = !in_spell ? 0 : before.in_spell ? before.lasted_s + length_s : share * length_s;
  return {in_spell, lasted_s, (before.recent << 2 | what) & kRecent};
}

}  // namespace

SpellBranch spell_stays(const Stalls& stalls, const SpellState& before, double length_s) {
  const double share = before.in_spell ? 1 : 0;
  return {share, 0, std::log(std::max(stay_probability(stalls, before, length_s), 1e-300)),
          after(before, before.in_spell, share, length_s, 0)};
}

std::array<SpellBranch, kSpellParts> spell_changes(const Stalls& stalls, const SpellState& before,
                                                   double length_s) {
  constexpr double kParts = kSpellParts;
  std::array<SpellBranch, kSpellParts> out{};
  for (std::uint32_t part = 0; part < kSpellParts; ++part) {
    const double share = (part + 0.5) / kParts;
    out[part] = {share, length_s / (12.0 * kParts * kParts),
                 std::log(std::max(1 - stay_probability(stalls, before, length_s), 1e-12)) - std::log(kParts),
                 after(before, !before.in_spell, share, length_s, part + 1)};
  }
  return out;
}

SpellBranch spell_changes_unseen(const Stalls& stalls, const SpellState& before, double length_s) {
  SpellBranch middle = spell_changes(stalls, before, length_s)[kSpellParts / 2];
  middle.log_probability += std::log(static_cast<double>(kSpellParts));
  return middle;
}

}  // namespace kilotwin::identify
