#include "runner.hpp"

#include <charconv>
#include <exception>

namespace kilotwin::station {
namespace {

/// Draws of one counter block: Random takes fewer than 2^17.
constexpr std::uint32_t kDrawsPerEntity = 1u << 16;

/// A number as the log shows it: three decimals.
std::string shown(double value) {
  std::array<char, 64> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed, 3);
  return {text.data(), end.ptr};
}

}  // namespace

Runner::Runner(std::unique_ptr<KilobotExperiment> experiment) : experiment_(std::move(experiment)) {
  experiment_->attach(this);
}

Runner::~Runner() {
  experiment_->attach(this);
  experiment_.reset();
}

Reply Runner::answer(const Request& request) {
  request_ = &request;
  reply_ = {};
  draws_ = 0;
  experiment_->attach(this);
  experiment_->setTime_s(request.time_s);
  try {
    switch (request.call) {
      case Call::kSetup: set_up(request); break;
      case Call::kStep: step(request); break;
      case Call::kSave: save(); break;
      case Call::kLoad: load(request); break;
      case Call::kStop:
        running_.function = "stopExperiment";
        experiment_->stopExperiment();
        break;
    }
    if (request.call == Call::kSetup || request.call == Call::kStep) reply_.word = experiment_->word();
  } catch (const std::exception& error) {
    reply_.failure = error.what();
  } catch (...) {
    reply_.failure = "an exception that is no std::exception";
  }
  if (!reply_.failure.empty()) {
    const char* const function = running_.function;
    std::string where = function == nullptr ? "word" : function;
    if (running_.robot >= 0) where += " of robot " + std::to_string(running_.robot);
    reply_.failure = where + ": " + reply_.failure;
    reply_.sent.clear();
  }
  running_.function = nullptr;
  running_.robot = -1;
  robot_at_hand_ = -1;
  return std::move(reply_);
}

void Runner::set_up(const Request& request) {
  parameters_ = request.parameters;
  random_ = Random(request.seed);
  index_ = request.index;
  arena_mm_ = {request.width_mm, request.height_mm};
  environment_of_.assign(request.robots.size(), nullptr);
  running_.function = "initialise";
  experiment_->initialise(request.resumed);
  for (const auto& [name, value] : parameters_) {
    if (!asked_parameters_.contains(name))
      throw std::runtime_error("the experiment gives parameter \"" + name + "\", which the plugin does not know");
  }
  // A resumed plugin gets to know its environments again; its state follows.
  if (!initial_states_given_) initialStates();
  if (request.resumed) {
    reply_.sent.clear();
    reply_.reports.clear();
    reply_.complete = false;
  }
  reply_.interval_ms = experiment_->serviceInterval_ms();
  if (reply_.interval_ms < 1) throw std::runtime_error("serviceInterval is below 1 ms");
}

void Runner::step(const Request& request) {
  running_.function = "run";
  experiment_->run();
  running_.robot = -1;
  if (request.log) {
    running_.function = "logState";
    for (std::uint32_t robot = 0; robot < robots(); ++robot) reply_.rows.push_back(log_row(robot, request.time_s));
  }
  if (request.paint) paint();
}

void Runner::save() {
  running_.function = "serialize";
  Archive archive;
  std::vector<std::uint32_t> indices;
  for (KilobotEnvironment* const environment : environment_of_) indices.push_back(index_of(environment));
  archive& indices;
  experiment_->serializeDrawings(archive);
  experiment_->serialize(archive);
  reply_.resumable = archive.isProvided();
  reply_.state = archive.octets();
}

void Runner::load(const Request& request) {
  running_.function = "serialize";
  Archive archive(request.state);
  std::vector<std::uint32_t> indices;
  archive& indices;
  if (indices.size() != environment_of_.size())
    throw std::runtime_error("the state is of another number of robots");
  for (std::size_t robot = 0; robot < indices.size(); ++robot) {
    if (indices[robot] > environments_.size())
      throw std::runtime_error("a robot's environment is unknown: addEnvironment() it in initialise()");
    environment_of_[robot] = indices[robot] == 0 ? nullptr : environments_[indices[robot] - 1];
  }
  experiment_->serializeDrawings(archive);
  experiment_->serialize(archive);
  if (!archive.isProvided()) throw std::runtime_error("the plugin has no serialize()");
  if (!archive.atEnd()) throw std::runtime_error("it read less than it had saved");
}

Kilobot Runner::seen(std::uint32_t robot) const {
  const SeenRobot& seen = request_->robots[robot];
  Point position(seen.x_mm, seen.y_mm), velocity(seen.vx_mm, seen.vy_mm);
  if (picture_frame_) {
    position = {seen.x_mm + arena_mm_.x() / 2, arena_mm_.y() / 2 - seen.y_mm};
    velocity = {seen.vx_mm, -seen.vy_mm};
  }
  return {static_cast<kilobot_id>(robot), position, velocity, seen.colour, seen.seen};
}

void Runner::initialStates() {
  initial_states_given_ = true;
  const char* const function = running_.function;
  running_.function = "setupInitialKilobotState";
  for (std::uint32_t robot = 0; robot < robots(); ++robot) {
    robot_at_hand_ = robot;
    running_.robot = static_cast<std::int32_t>(robot);
    experiment_->setupInitialKilobotState(seen(robot));
  }
  robot_at_hand_ = -1;
  running_.robot = -1;
  running_.function = function;
}

void Runner::updateStates() {
  const char* const function = running_.function;
  for (std::uint32_t robot = 0; robot < robots(); ++robot) {
    const Kilobot kilobot = seen(robot);
    robot_at_hand_ = robot;
    running_.robot = static_cast<std::int32_t>(robot);
    running_.function = "updateKilobotState";
    experiment_->updateKilobotState(kilobot);
    running_.function = "updateVirtualSensor";
    if (environment_of_[robot] != nullptr) environment_of_[robot]->updateVirtualSensor(kilobot);
  }
  robot_at_hand_ = -1;
  running_.robot = -1;
  running_.function = function;
}

std::uint32_t Runner::index_of(KilobotEnvironment* environment) {
  if (environment == nullptr) return 0;
  for (std::uint32_t i = 0; i < environments_.size(); ++i) {
    if (environments_[i] == environment) return i + 1;
  }
  environments_.push_back(environment);
  return static_cast<std::uint32_t>(environments_.size());
}

void Runner::setEnvironment(KilobotEnvironment* environment) {
  static_cast<void>(index_of(environment));
  if (robot_at_hand_ >= 0) {
    environment_of_[static_cast<std::size_t>(robot_at_hand_)] = environment;
    return;
  }
  environment_of_.assign(environment_of_.size(), environment);
}

void Runner::send(const kilobot_message& message) {
  if (message.id >= robots())
    throw std::runtime_error("a message for robot " + std::to_string(message.id) + ", which does not exist");
  Sent sent;
  sent.id = message.id;
  sent.type = message.type;
  sent.data = message.data;
  reply_.sent.push_back(sent);
}

void Runner::broadcast(const kilobot_broadcast& message) {
  constexpr std::uint8_t kStop = 250, kLargestType = 127;
  if ((message.type < 1 || message.type > kLargestType) && message.type != kStop)
    throw std::runtime_error("a broadcast of type " + std::to_string(message.type) +
                             "; it takes 1..127, or 250 to stop");
  Sent sent;
  sent.to_all = true;
  sent.type = message.type;
  if (message.data.size() > sent.octets.size())
    throw std::runtime_error("a broadcast of " + std::to_string(message.data.size()) + " octets; it takes up to 9");
  for (std::size_t i = 0; i < message.data.size(); ++i) sent.octets[i] = message.data[i];
  reply_.sent.push_back(sent);
}

std::optional<std::string> Runner::parameter(const std::string& name) {
  asked_parameters_.insert(name);
  const auto found = parameters_.find(name);
  if (found == parameters_.end()) return std::nullopt;
  return found->second;
}

double Runner::uniform() {
  const std::uint32_t draw = draws_++;
  return random_.uniform(Stream::kStationPlugin, index_ | draw / kDrawsPerEntity << 16, Tick{request_->tick},
                         draw % kDrawsPerEntity);
}

double Runner::normal() {
  const std::uint32_t draw = draws_++;
  return random_.normal(Stream::kStationPlugin, index_ | draw / kDrawsPerEntity << 16, Tick{request_->tick},
                        draw % kDrawsPerEntity);
}

std::string Runner::log_row(std::uint32_t robot, double time_s) {
  const Kilobot kilobot = seen(robot);
  running_.robot = static_cast<std::int32_t>(robot);
  constexpr double kDegrees = 180 / 3.14159265358979323846;
  const double up = picture_frame_ ? -1 : 1;
  const double orientation_deg = kt_atan2(up * kilobot.getVelocity().y(), kilobot.getVelocity().x()) * kDegrees;
  std::string row = shown(time_s) + '\t' + std::to_string(robot) + '\t' + std::to_string(kilobot.getLedColour()) +
                    '\t' + shown(kilobot.getPosition().x()) + '\t' + shown(kilobot.getPosition().y()) + '\t' +
                    shown(orientation_deg);
  if (const std::string state = experiment_->logState(kilobot); !state.empty()) row += '\t' + state;
  for (char& c : row) {
    if (c == '\n') c = ' ';
  }
  return row;
}

void Runner::paint() {
  running_.function = "paintFloor";
  running_.robot = -1;
  experiment_->paintFloor(reply_.floor);
  if (picture_frame_) {
    for (Floor::Circle& circle : reply_.floor.circles)
      circle.centre = {circle.centre.x() - arena_mm_.x() / 2, arena_mm_.y() / 2 - circle.centre.y()};
  }
  constexpr double kFarthest_mm = 1e6;
  for (const Floor::Circle& circle : reply_.floor.circles) {
    for (const double length : {circle.centre.x(), circle.centre.y(), circle.radius}) {
      if (!(length >= -kFarthest_mm && length <= kFarthest_mm)) throw std::runtime_error("a circle out of range");
    }
  }
  reply_.painted = !reply_.floor.empty();
}

}  // namespace kilotwin::station
