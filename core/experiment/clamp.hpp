/// Values that a computation has put beyond the ranges of their fields.
#pragma once

namespace google::protobuf {
class Message;
}

namespace kilotwin {

/// Moves each number of an experiment or a model that is outside its field's range (fields.hpp) to the nearest value within.
void clamp_to_ranges(google::protobuf::Message& message);

}  // namespace kilotwin
