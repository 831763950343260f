#include "clients/doors/listener/listener.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/base/say.hpp"

namespace kilotwin::doors {

Listener::Listener(const Door& door) : door_(door), pattern_(door.settings.listener().line()) {}

std::optional<HeardMessage> Listener::heard(std::string_view text) {
  const std::optional<HeardLine> line = pattern_.match(text);
  if (!line) {
    const bool is_empty = std::all_of(text.begin(), text.end(), [](char c) { return c == ' ' || c == '\r'; });
    if (!is_empty && other_lines_++ == 0) first_other_ = one_line(text, 60);
    return std::nullopt;
  }
  const proto::ListenerDoor& settings = door_.settings.listener();
  HeardMessage message;
  std::copy(line->data.begin(), line->data.end(), message.message.begin());
  message.message.back() = line->type.value_or(0);
  message.distance_mm = static_cast<float>(line->distance_mm.value_or(-1));
  if (settings.has_robot()) message.listener = settings.robot();
  std::optional<std::uint64_t> sender = line->sender;
  if (!sender && settings.has_id_octet()) sender = message.message[settings.id_octet()];
  if (sender) {
    const auto robot = door_.names.of_number(*sender);
    if (!robot) {
      if (strangers_++ == 0) first_stranger_ = fmt::format("number {}", *sender);
      return std::nullopt;
    }
    message.robot = *robot;
  }
  ++messages_;
  return message;
}

std::string Listener::in_words() const {
  std::string text = fmt::format("{} messages", messages_);
  if (other_lines_ > 0) text += fmt::format("; {} other lines (the first: \"{}\")", other_lines_, first_other_);
  if (strangers_ > 0)
    text += fmt::format("; {} messages of no tracked robot (the first: {})", strangers_, first_stranger_);
  return text;
}

HeardWriter::HeardWriter(const dds::Participant& participant, std::string source)
    : source_(std::move(source)), writer_(participant, topics::heard_messages()) {}

void HeardWriter::write(const HeardMessage& message) {
  PublicHeardMessage sample{};
  source_.copy(sample.source, sizeof sample.source - 1);
  sample.number = number_++;
  sample.robot = message.robot;
  sample.listener = message.listener;
  sample.distance_mm = message.distance_mm;
  std::copy(message.message.begin(), message.message.end(), std::begin(sample.message));
  writer_.write(sample);
}

}  // namespace kilotwin::doors
