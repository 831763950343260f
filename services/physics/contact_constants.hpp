/// Constants of contact. docs/explanation/contact.md has the evidence.
#pragma once

namespace kilotwin::physics {

/// Of a robot's disc, mm.
inline constexpr double kDiameter_mm = 33;
/// An overlap below this is rounding and is left alone, mm.
inline constexpr double kOverlapTolerance_mm = 5e-10;

/// By which the force of a contact grows with what the two close. Six discs around one, each with six, are stable below 1/6: the
/// sum of n n^T over six normals has the eigenvalue 3, a contact has two ends, and the masses are the unit.
inline constexpr double kGain = 0.15;
/// By which the friction of a contact grows with what the rims slide. Six discs around one, each with six, have
/// 6 (kGain + kTangentGain) = 1.26, below the 4/3 up to which the iteration converges (Banert et al., 2023).
inline constexpr double kTangentGain = 0.06;
/// How fast a force ends where a gap opens beyond what a contact bridges, over how fast it ends where bodies part. With 1, a chain
/// of robots hammers on what it pushes, and so moves what its force does not.
inline constexpr double kEase = 0.25;
/// The inertia of all that moves, over its true one. Kilobots are quasi-static: inertia decides nothing, and forces in a jam find
/// their balance the sooner the less of them it takes to stop a body.
inline constexpr double kInertia = 2;

/// The gap where there is no contact: so wide that it never acts, mm.
inline constexpr double kNoContact_mm = 1e100;
/// Contacts are listed up to so much beyond where they matter, so that a list stays good until somebody has moved by half of it.
/// A wider one adds contacts that do nothing.
inline constexpr double kSkin_mm = 4;

}  // namespace kilotwin::physics
