/// Constants of the contact solver. docs/explanation/contact.md states their sources.
#pragma once

namespace kilotwin::physics {

/// Diameter of a robot's disc, mm.
inline constexpr double kDiameter_mm = 33;
/// Overlaps below this are rounding errors and are ignored, mm.
inline constexpr double kOverlapTolerance_mm = 5e-10;

/// Gain of the normal impulse per closing speed. Six discs around one, each with six contacts, are stable below 1/6: the sum
/// of n n^T over six normals has the eigenvalue 3, a contact has two ends, and masses are 1.
inline constexpr double kGain = 0.15;
/// Gain of the tangent impulse per sliding speed. Six discs around one, each with six contacts, have
/// 6 (kGain + kTangentGain) = 1.26. The iteration converges below 4/3 (Banert et al., 2023).
inline constexpr double kTangentGain = 0.06;
/// Ratio of two decay rates of an impulse: while the gap exceeds the touch distance, and while the bodies part. With 1, a
/// chain of robots hits the body that it pushes again and again, and so moves a body that its force cannot move.
inline constexpr double kEase = 0.25;
/// Ratio of the bodies' inertia in the solver to their true inertia. Kilobots are quasi-static: inertia does not matter.
/// Forces in a jam balance faster with a smaller inertia, because less force stops a body.
inline constexpr double kInertia = 2;

/// Gap that stands for "no contact": so wide that it never acts, mm.
inline constexpr double kNoContact_mm = 1e100;
/// Contacts are listed up to this distance beyond the cutoff. A list is valid until a body has moved by half of it, mm.
/// A wider skin adds contacts without effect.
inline constexpr double kSkin_mm = 4;

}  // namespace kilotwin::physics
