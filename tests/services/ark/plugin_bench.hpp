/// One built-in plugin on its own: a single robot is shown to it, and its message for that robot comes back.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "core/base/pose.hpp"
#include "core/math/elementary.h"
#include "services/ark/ark_message.hpp"
#include "services/ark/plugin_host.hpp"

namespace kilotwin::ark {

class PluginBench {
 public:
  struct Robot {
    std::uint32_t id = 0;
    Pose pose{};
    station::lightColour colour = station::OFF;
    bool seen = true;
  };

  PluginBench(const std::string& built_in, const std::map<std::string, std::string>& parameters,
              std::uint32_t robots)
      : PluginBench(make_plugin_host({built_in, built_in, "", parameters, false, {}}, "", ""), parameters, robots) {
  }
  PluginBench(std::unique_ptr<PluginHost> plugin, const std::map<std::string, std::string>& parameters,
              std::uint32_t robots, std::uint64_t seed = 1)
      : host(std::move(plugin)), robots_(robots) {
    station::Request request = this->request(station::Call::kSetup);
    request.width_mm = request.height_mm = 2000;
    request.seed = seed;
    request.parameters = parameters;
    set_up = host->ask(request);
  }

  /// A step in which all other robots are out of sight.
  station::Reply step(const Robot& robot) {
    station::Request request = this->request(station::Call::kStep);
    request.robots[robot.id] = {
        robot.pose.x_mm, robot.pose.y_mm, kt_cos(robot.pose.heading_rad), kt_sin(robot.pose.heading_rad),
        robot.colour,    robot.seen};
    request.tick = ++ticks_;
    request.time_s = 0.1 * static_cast<double>(ticks_);
    request.log = true;
    request.paint = true;
    station::Reply reply = host->ask(request);
    last_word = reply.word;
    return reply;
  }
  std::optional<ArkMessage> sense(const Robot& robot) {
    const station::Reply reply = step(robot);
    if (!reply.failure.empty()) throw std::runtime_error(reply.failure);
    for (const station::Sent& sent : reply.sent) {
      if (!sent.to_all && sent.id == robot.id) return ArkMessage{sent.id, sent.type, sent.data};
    }
    return std::nullopt;
  }
  std::string save() { return host->ask(request(station::Call::kSave)).state; }
  station::Reply load(const std::string& state) {
    station::Request request = this->request(station::Call::kLoad);
    request.state = state;
    return host->ask(request);
  }

  std::unique_ptr<PluginHost> host;
  station::Reply set_up;
  std::uint64_t last_word = 0;

 private:
  [[nodiscard]] station::Request request(station::Call call) const {
    station::Request request;
    request.call = call;
    request.robots.resize(robots_);
    for (station::SeenRobot& robot : request.robots) robot.seen = false;
    return request;
  }
  std::uint32_t robots_;
  std::int64_t ticks_ = 0;
};

}  // namespace kilotwin::ark
