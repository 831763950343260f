/// Conversion of the schema's messages to settings. Absent fields get the schema's defaults.
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

/// Throws UserError if the manifest has another format or is inconsistent.
void check_manifest(const proto::Manifest&);

/// The settings of a manifest. Requires that check_manifest() accepts it.
[[nodiscard]] PlanSettings settings_of(const proto::Manifest&);

/// The settings of single messages, for code that has no manifest.
[[nodiscard]] EffectSettings settings_of(const proto::Effect&);
[[nodiscard]] FunctionSettings settings_of(const proto::Function&);
[[nodiscard]] LightSourceSettings settings_of(const proto::LightSource&);
[[nodiscard]] EnvironmentSettings settings_of(const proto::VirtualEnvironment&);
[[nodiscard]] Program settings_of(const proto::Program&);

}  // namespace kilotwin
