#include "clients/identify/result/covariate_words.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace kilotwin::identify {

std::string covariate_in_words(std::string_view covariate) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 6> kWords = {
      {{"time_since_command", "time since the command"},
       {"motor_time", "motor-on time"},
       {"world_frame", "the directions of the arena"},
       {"measurement", "the camera"},
       {"history", "what the robot did before"},
       {"episodes", "random spells"}}};
  const auto at = std::find_if(kWords.begin(), kWords.end(), [&](const auto& w) { return w.first == covariate; });
  std::string words(at == kWords.end() ? covariate : at->second);
  std::replace(words.begin(), words.end(), '_', ' ');
  return words;
}

}  // namespace kilotwin::identify
