#include "services/physics/ode_world.hpp"

#include <algorithm>
#include <cstdarg>
#include <mutex>
#include <vector>

#include <ode/ode.h>

#include "core/base/error.hpp"
#include "services/physics/contact_limits.hpp"

namespace kilotwin::physics {
namespace {

/// Fraction of an overlap that a step closes (ODE's manual: 0.1..0.8). The solver's error appears as overlap, which is
/// smaller for larger fractions. For a crowd of 1000 robots that all drive to its centre: 0.2 mm with 0.8, 0.8 mm with 0.2.
constexpr double kErrorReduction = 0.8;
/// Compliance of all constraints, 1/g per step: a millionth of a robot's inverse mass. It makes four points of
/// support solvable, and its effect is too small to be seen.
constexpr double kCompliance_1_g = 1e-7;
/// Compliance of dry friction, where it causes creep: with 1e-7, four robots would move a box of 18 g by 1 um/s.
constexpr double kGripCompliance_1_g = 1e-12;
/// Sweeps of the iterative solver. Where robots push a movable body, their forces add up to nearly the friction limit, and the
/// solver's error is creep: 0.2 mm/s for four robots in a row with 20 sweeps, 2e-4 mm/s with 200. Groups of more than 32
/// bodies get fewer sweeps, to bound the time.
constexpr std::size_t kSweeps = 20, kMostSweeps = 200, kSweepsTimesBodies = 6400;

/// ODE's random numbers are one sequence per process.
std::mutex& random_numbers() {
  static std::mutex mutex;
  return mutex;
}

/// Set by ODE's message handler. Worlds of contacts cause one message only: the exact solver finds no further step because
/// of rounding. It then leaves forces out.
thread_local bool solver_gave_up = false;
void handle_message(int, const char*, va_list) { solver_gave_up = true; }

void start_ode() {
  static const bool started = [] {
    dSetMessageHandler(&handle_message);
    return dInitODE2(0) != 0;
  }();
  KILOTWIN_DEMAND(started);
}

}  // namespace

Inertia Inertia::prism(double mass_g, const Convex& shape, double height_mm) {
  // Means of x^2, y^2 and x y over the area. A polygon is divided into triangles between its centre and its edges.
  double xx = shape.radius_mm() * shape.radius_mm() / 4, yy = xx, xy = 0;
  const std::vector<Point2>& corners = shape.corners();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Point2 a = corners[i], b = corners[(i + 1) % corners.size()];
    const double part = (a.x_mm * b.y_mm - b.x_mm * a.y_mm) / (12 * shape.area_mm2());
    xx += part * (a.x_mm * a.x_mm + a.x_mm * b.x_mm + b.x_mm * b.x_mm);
    yy += part * (a.y_mm * a.y_mm + a.y_mm * b.y_mm + b.y_mm * b.y_mm);
    xy += part * (a.x_mm * a.y_mm + (a.x_mm * b.y_mm + b.x_mm * a.y_mm) / 2 + b.x_mm * b.y_mm);
  }
  const double across = height_mm * height_mm / 12;
  return {mass_g, {mass_g * (yy + across), mass_g * (xx + across), mass_g * (xx + yy)}, -mass_g * xy};
}

struct OdeWorld::Handles {
  dWorldID world = nullptr;
  dJointGroupID contacts = nullptr;
  dThreadingImplementationID threading = nullptr;
  std::vector<dBodyID> bodies;
};

OdeWorld::OdeWorld(Vector3 gravity_mm_s2, double step_s) : step_s_(step_s), handles_(std::make_unique<Handles>()) {
  start_ode();
  Handles& h = *handles_;
  h.world = dWorldCreate();
  h.contacts = dJointGroupCreate(0);
  // By default all worlds share one work list, which two threads must not use at the same time.
  h.threading = dThreadingAllocateSelfThreadedImplementation();
  dWorldSetStepThreadingImplementation(h.world, dThreadingImplementationGetFunctions(h.threading), h.threading);
  dWorldSetGravity(h.world, gravity_mm_s2[0], gravity_mm_s2[1], gravity_mm_s2[2]);
  dWorldSetERP(h.world, kErrorReduction);
  dWorldSetCFM(h.world, kCompliance_1_g);
  dWorldSetContactMaxCorrectingVel(h.world, kSeparation_mm_s);
  dWorldSetContactSurfaceLayer(h.world, 0);
  dWorldSetAutoDisableFlag(h.world, 0);
}

OdeWorld::~OdeWorld() {
  if (!handles_) return;
  dJointGroupDestroy(handles_->contacts);
  dWorldDestroy(handles_->world);
  dThreadingFreeImplementation(handles_->threading);
}

OdeWorld::OdeWorld(OdeWorld&&) noexcept = default;

void OdeWorld::clear() {
  dJointGroupEmpty(handles_->contacts);
  for (auto* const body : handles_->bodies) dBodyDestroy(body);
  handles_->bodies.clear();
}

std::uint32_t OdeWorld::add(const Inertia& inertia, const RigidState& state) {
  auto* const body = dBodyCreate(handles_->world);
  dMass mass;
  const Vector3& moment = inertia.moment_g_mm2;
  dMassSetParameters(&mass, inertia.mass_g, 0, 0, 0, moment[0], moment[1], moment[2], inertia.product_xy_g_mm2, 0,
                     0);
  dBodySetMass(body, &mass);
  dBodySetPosition(body, state.position_mm[0], state.position_mm[1], state.position_mm[2]);
  dBodySetQuaternion(body, state.rotation.data());
  dBodySetLinearVel(body, state.velocity_mm_s[0], state.velocity_mm_s[1], state.velocity_mm_s[2]);
  dBodySetAngularVel(body, state.spin_rad_s[0], state.spin_rad_s[1], state.spin_rad_s[2]);
  handles_->bodies.push_back(body);
  return static_cast<std::uint32_t>(handles_->bodies.size() - 1);
}

void OdeWorld::add(const TouchPoint& touch) {
  dContact contact{};
  for (int k = 0; k < 3; ++k) {
    contact.geom.pos[k] = touch.at_mm[static_cast<std::size_t>(k)];
    contact.geom.normal[k] = touch.normal[static_cast<std::size_t>(k)];
    contact.fdir1[k] = touch.axis[static_cast<std::size_t>(k)];
  }
  contact.surface.mode = dContactFDir1 | dContactAxisDep;
  if (touch.friction != TouchPoint::Friction::kNone) {
    contact.surface.mode |= dContactMotion1 | dContactMotion2;
    if (touch.friction == TouchPoint::Friction::kCoulomb) {
      contact.surface.mode |= dContactApprox1 | dContactSlip1 | dContactSlip2;
      contact.surface.slip1 = contact.surface.slip2 = kGripCompliance_1_g;
    }
    contact.surface.mu = touch.grip[0];
    contact.surface.mu2 = touch.grip[1];
    contact.surface.motion1 = touch.motion_mm_s[0];
    contact.surface.motion2 = touch.motion_mm_s[1];
  }
  if (touch.gap_mm > 0) {
    contact.surface.mode |= dContactMotionN;
    contact.surface.motionN = -touch.gap_mm / step_s_;
  } else {
    contact.geom.depth = -touch.gap_mm;
  }
  auto* const joint = dJointCreateContact(handles_->world, handles_->contacts, &contact);
  auto* const other = touch.other == TouchPoint::kStanding ? nullptr : handles_->bodies[touch.other];
  dJointAttach(joint, handles_->bodies[touch.body], other);
}

bool OdeWorld::step(Solver solver, std::uint64_t seed, bool pushes) {
  solver_gave_up = false;
  if (solver == Solver::kExact) {
    KILOTWIN_DEMAND(dWorldStep(handles_->world, step_s_) != 0);
  } else {
    const std::lock_guard lock(random_numbers());
    const std::size_t sweeps =
        pushes ? std::clamp(kSweepsTimesBodies / handles_->bodies.size(), kSweeps, kMostSweeps) : kSweeps;
    dWorldSetQuickStepNumIterations(handles_->world, static_cast<int>(sweeps));
    dRandSetSeed(static_cast<unsigned long>(seed & 0xffffffff));
    KILOTWIN_DEMAND(dWorldQuickStep(handles_->world, step_s_) != 0);
  }
  dJointGroupEmpty(handles_->contacts);
  return !solver_gave_up;
}

void OdeWorld::read(std::uint32_t body, RigidState& state) const {
  auto* const id = handles_->bodies[body];
  const dReal *position = dBodyGetPosition(id), *rotation = dBodyGetQuaternion(id),
              *velocity = dBodyGetLinearVel(id), *spin = dBodyGetAngularVel(id);
  for (std::size_t k = 0; k < 3; ++k) {
    state.position_mm[k] = position[k];
    state.velocity_mm_s[k] = velocity[k];
    state.spin_rad_s[k] = spin[k];
  }
  for (std::size_t k = 0; k < 4; ++k) state.rotation[k] = rotation[k];
}

}  // namespace kilotwin::physics
