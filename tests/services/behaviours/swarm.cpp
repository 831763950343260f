#include "tests/services/behaviours/swarm.hpp"

#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <stdexcept>

#include "core/os/files.hpp"
#include "idl/manifest.pb.h"

namespace kilotwin::behaviours::test {
namespace fs = std::filesystem;

Folder::Folder() {
  std::string name = (fs::temp_directory_path() / "kilotwin-test-XXXXXX").string();
  EXPECT_NE(mkdtemp(name.data()), nullptr);
  path_ = name;
}

Folder::~Folder() { fs::remove_all(path_); }

fs::path Folder::write(const std::string& name, const std::string& text) const {
  fs::create_directories((path_ / name).parent_path());
  os::write_file(path_ / name, text);
  return path_ / name;
}

CompileOptions cached() { return {{}, {}, KILOTWIN_TEST_CACHE}; }

std::string program(const std::string& body) {
  return "#include <kilolib.h>\n"
         "#include <stdlib.h>\n"
         "#include <string.h>\n"
         "static void rx(message_t* m, distance_measurement_t* d);\n"
         "static message_t* tx(void);\n"
         "static void tx_success(void);\n"
         "static void setup(void);\n"
         "static void loop(void);\n#line 1\n" +
         body +
         (body.find("void rx(") == std::string::npos
              ? "\nstatic void rx(message_t* m, distance_measurement_t* d) {}"
              : "") +
         (body.find("* tx(") == std::string::npos ? "\nstatic message_t* tx(void) { return 0; }" : "") +
         (body.find("void tx_success(") == std::string::npos ? "\nstatic void tx_success(void) {}" : "") +
         (body.find("void setup(") == std::string::npos ? "\nstatic void setup(void) {}" : "") +
         (body.find("void loop(") == std::string::npos ? "\nstatic void loop(void) {}" : "") +
         "\nint main(void) { kilo_init(); kilo_message_rx = rx; kilo_message_tx = tx; kilo_message_tx_success = "
         "tx_success;\n"
         "  kilo_start(setup, loop); return 0; }\n";
}

bool mentions(const std::vector<std::string>& lines, const std::string& text) {
  return std::any_of(lines.begin(), lines.end(),
                     [&](const std::string& line) { return line.find(text) != std::string::npos; });
}

std::string ready_made(const std::string& name) { return std::string(KILOTWIN_BEHAVIOURS) + "/" + name; }

IrMessage message(std::uint8_t type, std::uint8_t first_octet) {
  IrMessage result{};
  result[0] = first_octet;
  result[9] = type;
  return result;
}

RadioFrame Air::frame(Tick tick, const Share& share) const {
  RadioFrame frame;
  frame.tick = tick;
  frame.first_robot = share.first;
  frame.kilo_ticks.assign(share.size(), kilo_ticks);
  for (const std::uint32_t robot : ask) {
    if (share.contains(robot)) frame.ask.push_back(robot);
  }
  for (const std::uint32_t robot : sent) {
    if (share.contains(robot)) frame.sent.push_back(robot);
  }
  for (const Reception& reception : receptions) {
    if (!share.contains(reception.robot)) continue;
    frame.reception_robot.push_back(reception.robot);
    frame.reception_message.push_back(static_cast<std::uint16_t>(frame.messages.size()));
    frame.reception_high_gain.push_back(reception.high_gain);
    frame.reception_low_gain.push_back(reception.low_gain);
    frame.messages.push_back(reception.message);
    frame.message_crc_error.push_back(reception.crc_error);
  }
  return frame;
}

Swarm::Swarm(const std::vector<std::string>& texts, std::uint32_t robots, std::uint32_t host_count,
             const std::string& experiment, const std::function<void(proto::Manifest&)>& edit) {
  proto::Manifest manifest;
  EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString(experiment, manifest.mutable_experiment()));
  manifest.set_run(1);
  manifest.mutable_experiment()->mutable_deployment()->set_hosts(host_count);
  manifest.mutable_experiment()->mutable_motion()->set_calibrated_turn_duty(60);
  for (std::size_t p = 0; p < texts.size(); ++p) {
    const bool is_path = texts[p].find_first_of("\n{") == std::string::npos;
    const fs::path source =
        is_path ? fs::path(texts[p]) : folder.write("program" + std::to_string(p) + ".c", texts[p]);
    const CompiledProgram compiled = compile({source}, cached());
    folder.write("programs/" + compiled.sha256 + ".so", os::read_if_there(compiled.file).value());
    proto::Program& entry = *manifest.add_program();
    entry.set_path(source.filename());
    entry.set_sha256(compiled.sha256);
    proto::RobotGroup& group = *manifest.mutable_experiment()->add_robots();
    group.set_count(robots);
    group.set_loop_rate(proto::RobotGroup::ONCE_PER_TICK);  // tests count calls of loop(); `edit` may change it
    manifest.add_group_program(static_cast<std::uint32_t>(p));
    for (std::uint32_t i = 0; i < robots; ++i) {
      manifest.add_x_mm(40.0 * i);
      manifest.add_y_mm(40.0 * static_cast<double>(p));
      manifest.add_heading_rad(0);
    }
  }
  if (edit) edit(manifest);
  plan = std::make_unique<RunPlan>(manifest);
  for (std::uint32_t robot = 0; robot < plan->robots(); ++robot) {
    const Pose pose = plan->initial_pose(robot);
    bodies.add(robot, pose.x_mm, pose.y_mm, pose.heading_rad);
  }
  programs = ProgramSet::load(*plan, folder.path());
  for (std::uint32_t h = 0; h < host_count; ++h) {
    hosts.push_back(std::make_unique<BehavioursEngine>(*plan, HostId{h}, programs));
    hosts.back()->compare_unchanged_calls();
  }
}

void Swarm::step(const Air& air) {
  bodies.tick = tick;
  const BodyFrame* const all[] = {&bodies};
  SwarmView view(plan->robots(), plan->movables(), plan->memory.size());
  view.gather(tick, all);
  for (std::uint32_t h = 0; h < hosts.size(); ++h) {
    hosts[h]->step(tick, air.frame(tick, plan->share(HostId{h})), &view);
    if (hosts[h]->unchanged_calls().differing != 0)
      throw std::logic_error(
          "a call of loop() changed the state, but the program's count of writes says that it did not");
  }
  ++tick;
}

void Swarm::start() {
  step();
  Air air;
  for (std::uint32_t robot = 0; robot < plan->robots(); ++robot) air.receptions.push_back({robot, message(kRun)});
  step(air);
}

ActuationFrame Swarm::frame() const {
  ActuationFrame all;
  all.tick = tick;
  for (const auto& host : hosts) {
    ActuationFrame part;
    host->emit(part);
    EXPECT_EQ(part.first_robot, all.led.size());
    auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
    append(all.motor_left, part.motor_left);
    append(all.motor_right, part.motor_right);
    append(all.led, part.led);
    append(all.life_cycle, part.life_cycle);
    append(all.tx_period, part.tx_period);
    append(all.spin_up, part.spin_up);
    append(all.offer_robot, part.offer_robot);
    append(all.offer_message, part.offer_message);
    append(all.offer_crc_error, part.offer_crc_error);
    all.offer_crc_error.resize(all.offer_message.size(), 0);
  }
  return all;
}

std::uint64_t Swarm::hash() const {
  std::uint64_t sum = 0;
  for (const auto& host : hosts) sum += host->hash_part();
  return sum;
}

Air echo(const ActuationFrame& frame) {
  Air air;
  const auto robots = static_cast<std::uint32_t>(frame.led.size());
  for (std::uint32_t robot = 0; robot < robots; ++robot) {
    if ((robot * 7 + static_cast<std::uint64_t>(frame.tick.count())) % 16 == 0) air.ask.push_back(robot);
  }
  air.sent = frame.offer_robot;
  for (std::size_t n = 0; n < frame.offer_robot.size(); ++n) {
    for (std::uint32_t next = 1; next <= 2; ++next) {
      const std::uint32_t robot = (frame.offer_robot[n] + next) % robots;
      air.receptions.push_back({robot, frame.offer_message[n], static_cast<std::int16_t>(next == 1 ? 740 : 300),
                                static_cast<std::int16_t>(next == 1 ? 550 : 220)});
    }
  }
  std::stable_sort(air.receptions.begin(), air.receptions.end(),
                   [](const Air::Reception& a, const Air::Reception& b) { return a.robot < b.robot; });
  return air;
}

bool equal(const ActuationFrame& a, const ActuationFrame& b) {
  return a.motor_left == b.motor_left && a.motor_right == b.motor_right && a.led == b.led &&
         a.life_cycle == b.life_cycle && a.tx_period == b.tx_period && a.spin_up == b.spin_up &&
         a.offer_robot == b.offer_robot && a.offer_message == b.offer_message;
}

Air to_all(const Swarm& swarm, const IrMessage& what) {
  Air air;
  for (std::uint32_t robot = 0; robot < swarm.plan->robots(); ++robot) air.receptions.push_back({robot, what});
  return air;
}

}  // namespace kilotwin::behaviours::test
