/// A federate's inputs, ring buffers of frames that receive threads fill, and its outputs, writers of frames.
#pragma once

#include <fmt/format.h>

#include <array>
#include <span>

#include "core/base/error.hpp"
#include "core/federation/frame_check.hpp"
#include "core/federation/session.hpp"

namespace kilotwin {

class InputBase {
 public:
  explicit InputBase(Session& session, std::vector<FederateId> publishers)
      : session_(session), gate_(std::move(publishers), session.first()) {
    session_.inputs_.push_back(this);
  }
  virtual ~InputBase() = default;
  InputBase(const InputBase&) = delete;
  /// Requires the session's mutex.
  [[nodiscard]] TickGate& gate() { return gate_; }

 protected:
  Session& session_;
  TickGate gate_;  // guarded by the session's mutex
};

/// The frames of one topic from a fixed set of publishers.
template <class Frame> class Input : public InputBase {
 public:
  using Wire = typename WireOf<Frame>::Type;

  Input(Session& session, const dds::Channel& channel, std::vector<FederateId> publishers)
      : InputBase(session, std::move(publishers)),
        rings_(gate_.publishers().size()),
        arrivals_(gate_.publishers().size()),
        current_(gate_.publishers().size()),
        topic_(channel.topic) {
    reader_ = std::make_unique<dds::Reader<Wire>>(
        session.participant(), channel, [this](const Wire& wire, dds::SampleState state) { take(wire, state); });
  }

  /// The frames of `tick`, by ascending publisher. They are valid until the session waits for the next tick.
  std::span<const Frame* const> at(Tick tick) {
    for (std::size_t i = 0; i < rings_.size(); ++i) {
      current_[i] = &rings_[i][static_cast<std::size_t>(tick.count() % kFrameRing)];
      KILOTWIN_DEMAND(current_[i]->tick == tick);
    }
    return current_;
  }

  /// When the last frame of `tick` came; as long as at() holds.
  [[nodiscard]] std::chrono::steady_clock::time_point arrived(Tick tick) const {
    auto last = std::chrono::steady_clock::time_point::min();
    for (const auto& times : arrivals_)
      last = std::max(last, times[static_cast<std::size_t>(tick.count() % kFrameRing)]);
    return last;
  }

 private:
  /// Called on a receive thread, one sample of this topic at a time. Decodes and checks a frame without the session's mutex: its
  /// ring slot is ahead of the tick that the session reads, and the session reads it only after the gate has accepted it.
  void take(const Wire& wire, dds::SampleState state) {
    if (!state.valid || wire.run != session_.plan().run() || !is_new(wire)) return;
    const FederateId publisher{wire.publisher};
    const auto index = static_cast<std::size_t>(gate_.index_of(publisher));
    Frame& frame = rings_[index][static_cast<std::size_t>(wire.tick % kFrameRing)];
    arrivals_[index][static_cast<std::size_t>(wire.tick % kFrameRing)] = std::chrono::steady_clock::now();
    const char* const wrong = from_wire(wire, frame) ? defect(frame, session_.plan(), publisher, session_.self())
                                                     : "its arrays differ in length";
    const std::lock_guard lock(session_.mutex());
    if (wrong != nullptr) {
      return session_.fail(fmt::format("{}: frame {} of {} is malformed: {}", topic_, wire.tick,
                                       session_.plan().name(publisher), wrong));
    }
    gate_.accept(publisher, Tick{wire.tick});
    session_.mention(wire.directives);
    session_.notify();  // after each frame, even if others are missing: waking up early hides scheduling delays
  }

  /// Handles hellos, and fails the session for an unexpected frame. True for the next frame of a publisher.
  bool is_new(const Wire& wire) {
    const std::lock_guard lock(session_.mutex());
    const FederateId publisher{wire.publisher};
    if (wire.tick < 0) {
      gate_.hello(publisher);
      session_.notify();
      return false;
    }
    // Before the start, a frame means that another process already runs as this federate. on_member() reports that.
    if (!session_.expects_frames()) return false;
    switch (gate_.arrival(publisher, Tick{wire.tick})) {
      case TickGate::Arrival::kNew: return true;
      case TickGate::Arrival::kRepeated: return false;
      case TickGate::Arrival::kUnexpected: break;
    }
    session_.fail(fmt::format("{}: frame {} of federate {} was not expected", topic_, wire.tick, wire.publisher));
    return false;
  }

  std::vector<std::array<Frame, kFrameRing>> rings_;
  std::vector<std::array<std::chrono::steady_clock::time_point, kFrameRing>> arrivals_;
  std::vector<const Frame*> current_;
  std::string topic_;
  std::unique_ptr<dds::Reader<Wire>>
      reader_;  // declared last: destroyed first, so that no callback uses a destroyed ring
};

class OutputBase {
 public:
  explicit OutputBase(Session& session) : session_(session) { session_.outputs_.push_back(this); }
  virtual ~OutputBase() = default;
  OutputBase(const OutputBase&) = delete;
  virtual void hello() = 0;
  virtual bool flush(double seconds) const = 0;

 protected:
  Session& session_;
};

template <class Frame> class Output : public OutputBase {
 public:
  using Wire = typename WireOf<Frame>::Type;

  Output(Session& session, const dds::Channel& channel)
      : OutputBase(session), writer_(session.participant(), channel) {}

  /// The engine's emit() fills it, then write() sends it. Its arrays are reused from tick to tick.
  Frame frame;
  void write() { writer_.write(to_wire(session_.header(), frame)); }

  void hello() override {
    Frame nothing{};
    nothing.tick = Tick{-1};
    writer_.write(to_wire(session_.header(), nothing));
  }
  bool flush(double seconds) const override { return writer_.flush(seconds); }

 private:
  dds::Writer<Wire> writer_;
};

}  // namespace kilotwin
