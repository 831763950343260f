/// The one place where plain settings are filled from the schema: defaults are the schema's.
#pragma once

#include "core/plan/settings.hpp"

namespace kilotwin {

namespace proto {
class Effect;
class Function;
class LightSource;
class Manifest;
class Program;
class VirtualEnvironment;
}  // namespace proto

/// Throws UserError where no plan can be made of the manifest.
void check_manifest(const proto::Manifest&);

/// Of a manifest that passes check_manifest.
[[nodiscard]] PlanSettings settings_of(const proto::Manifest&);

/// Parts, for those that work on messages of the schema without a manifest.
[[nodiscard]] EffectSettings settings_of(const proto::Effect&);
[[nodiscard]] FunctionSettings settings_of(const proto::Function&);
[[nodiscard]] LightSourceSettings settings_of(const proto::LightSource&);
[[nodiscard]] EnvironmentSettings settings_of(const proto::VirtualEnvironment&);
[[nodiscard]] Program settings_of(const proto::Program&);

}  // namespace kilotwin
