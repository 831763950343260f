#include "core/observations/variable_sampler.hpp"

#include <algorithm>
#include <array>
#include <bit>

#include "idl/manifest.pb.h"
#include "idl/recording.pb.h"

namespace kilotwin {
namespace {

/// Octets as an unsigned number, low octet first, as on x86-64 and on the AVR.
std::uint64_t joined(std::span<const std::uint8_t> octets) {
  std::uint64_t value = 0;
  for (std::size_t i = octets.size(); i-- > 0;) value = value << 8 | octets[i];
  return value;
}

std::uint64_t lowest(std::uint64_t value, unsigned bits) {
  return bits >= 64 ? value : value & ((std::uint64_t{1} << bits) - 1);
}

}  // namespace

VariableSampler::Place VariableSampler::place_of(const proto::VariablePlace& from) {
  Place place;
  place.address = from.address();
  place.pointer = from.pointer();
  place.octets = static_cast<std::uint8_t>(std::clamp(from.octets(), 1u, 8u));
  place.pointer_octets = static_cast<std::uint8_t>(std::min(from.pointer_octets(), 8u));
  place.bit_offset = static_cast<std::uint8_t>(std::min(from.bit_offset(), 63u));
  place.bits = static_cast<std::uint8_t>(std::min(from.bits(), 64u));
  place.kind = static_cast<Kind>(from.kind());
  return place;
}

VariableSampler::VariableSampler(const RunPlan& plan, Share share, bool firmware) {
  const proto::Manifest& manifest = plan.manifest();
  for (int v = 0; v < manifest.variable_size(); ++v) {
    const proto::ProgramVariable& from = manifest.variable(v);
    Variable variable{
        static_cast<std::uint32_t>(v), from.integer(), RecordingSchedule(plan.tick_length, from.every_s()), {}, {}};
    for (const proto::VariablePlace& place : from.place()) variable.places.push_back(place_of(place));
    for (std::uint32_t robot = share.first; robot < share.last; ++robot) {
      const std::uint32_t program = plan.program_of(robot);
      if (program == kNoProgram || plan.firmware(robot) != firmware) continue;
      for (int p = 0; p < from.place_size(); ++p) {
        if (from.place(p).program() == program) variable.readings.push_back({robot, static_cast<std::uint32_t>(p)});
      }
    }
    if (!variable.readings.empty()) variables_.push_back(std::move(variable));
  }
}

bool VariableSampler::fetch(const Place& place, std::uint32_t robot, const ProgramMemory& memory,
                            std::uint64_t& raw) {
  std::array<std::uint8_t, 8> octets{};
  std::uint64_t address = place.address;
  if (place.pointer_octets != 0) {
    const std::span pointer(octets.data(), place.pointer_octets);
    if (!memory.read(robot, place.pointer, pointer)) return false;
    const std::uint64_t value = joined(pointer);
    if (value == 0) return false;
    address += memory.address_of(robot, value);
  }
  const std::span value(octets.data(), place.octets);
  if (!memory.read(robot, address, value)) return false;
  raw = joined(value);
  return true;
}

std::int64_t VariableSampler::whole(const Place& place, std::uint64_t raw) {
  const unsigned bits = place.bits != 0 ? place.bits : place.octets * 8u;
  const std::uint64_t value = lowest(raw >> place.bit_offset, bits);
  if (place.kind != Kind::kSigned || bits >= 64 || (value >> (bits - 1) & 1) == 0)
    return static_cast<std::int64_t>(value);
  return static_cast<std::int64_t>(value | ~std::uint64_t{0} << bits);
}

double VariableSampler::number(const Place& place, std::uint64_t raw) {
  if (place.kind != Kind::kFloat) return static_cast<double>(whole(place, raw));
  if (place.octets == 4) return static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(raw)));
  return std::bit_cast<double>(raw);
}

void VariableSampler::sample(Tick now, const ProgramMemory& memory, proto::Observations& to) const {
  for (const Variable& variable : variables_) {
    if (!variable.schedule.due(now)) continue;
    proto::VariableRecord& record = *to.add_variable();
    record.set_tick(now.count());
    record.set_variable(variable.index);
    for (const Reading& reading : variable.readings) {
      const Place& place = variable.places[reading.place];
      std::uint64_t raw = 0;
      if (!fetch(place, reading.robot, memory, raw)) continue;
      record.add_robot(reading.robot);
      if (variable.integer)
        record.add_integer(whole(place, raw));
      else
        record.add_number(number(place, raw));
    }
    if (record.robot_size() == 0) to.mutable_variable()->RemoveLast();
  }
}

}  // namespace kilotwin
